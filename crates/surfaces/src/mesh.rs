//! Surfaces given by triangles.
//!
//! **Method.** The bytes of an STL file become a `parry3d` triangle mesh, which casts rays, finds nearest points through a
//! tree of boxes, and distinguishes inside from outside by angle-weighted pseudo-normals. Normals for the tool are blended
//! between the corners of a triangle, so that they vary smoothly over a finely faceted surface, except across a crease.
//!
//! **Shapes.** Vertices in mm in the file's frame, which is the surface's frame. Plan coordinates are (x, y), seen from
//! above.
//!
//! **Stops.** Nothing iterates.
//!
//! **Source and departures.** J. A. Bærentzen and H. Aanæs, *Signed distance computation using the angle weighted
//! pseudonormal*, 2005, as implemented in parry. STL has no units and no shared vertices: the unit is stated, equal corners
//! are merged, and triangles without area are dropped. A binary file whose header begins with `solid` is recognised by its
//! length.
//!
//! **Checked against.** A faceted sphere, whose distance to the true one is bounded by its facets.

use std::collections::BTreeMap;

use glamx::DVec3;
use nalgebra::{Point3, Unit, Vector3};
use parry3d_f64::query::{PointQueryWithLocation, Ray, RayCast};
use parry3d_f64::shape::{TriMesh, TriMeshFlags, TrianglePointLocation};

use crate::contact::{Contact, Foot};
use crate::domain::Domain;
use crate::error::SurfaceError;
use crate::tessellation::Tessellation;
use truegrind_math::statistics;

/// Triangles that meet at a smaller angle than this share a smooth normal.
const CREASE_RAD: f64 = std::f64::consts::FRAC_PI_6;
/// A smaller mesh is assumed to be in metres or inches.
const MIN_SIZE_MM: f64 = 2.0;
/// Largest workpiece: a kilometre.
const MAX_SIZE_MM: f64 = 1e6;

/// A surface of triangles, wound counter-clockwise seen from outside.
#[derive(Clone)]
pub struct Mesh {
    /// Boxed, since it occupies some 300 bytes inline.
    triangles: Box<TriMesh>,
    domain: Domain,
    facet_normals: Vec<Unit<Vector3<f64>>>,
    /// Smooth normal at each corner of each facet.
    corner_normals: Vec<[Unit<Vector3<f64>>; 3]>,
    /// For each facet and each of its edges 0–1, 1–2, 2–0: whether no other facet adjoins it.
    open_edges: Vec<[bool; 3]>,
    /// For each vertex: whether it lies on the border.
    open_vertices: Vec<bool>,
    /// Length over which normals of neighbouring facets differ: twice the mean edge.
    scale_mm: f64,
    /// Mean number of triangle boxes that a vertical ray meets.
    stacked: f64,
}

impl std::fmt::Debug for Mesh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Mesh")
            .field("triangles", &self.triangles.num_triangles())
            .field("domain", &self.domain)
            .finish_non_exhaustive()
    }
}

/// Interpretation of the numbers of a mesh file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshOptions {
    /// Length of one unit of the file in mm: 1 for mm, 25.4 for inches, 1000 for metres.
    pub unit_mm: f64,
    /// Whether the triangles are wound clockwise.
    pub flipped: bool,
    /// Part of the mesh to be used, in plan; all of it if `None`.
    pub domain: Option<Domain>,
}

impl Default for MeshOptions {
    fn default() -> Self {
        Self { unit_mm: 1.0, flipped: false, domain: None }
    }
}

impl Mesh {
    /// Reads an STL file, binary or text.
    ///
    /// ```
    /// use truegrind_surfaces::mesh::{Mesh, MeshOptions};
    /// use truegrind_surfaces::{Surface, sample};
    ///
    /// let mesh = Mesh::from_stl(sample::PLATE_STL, &MeshOptions::default())?;
    /// assert_eq!(mesh.triangle_count(), 1676);
    /// let plate = Surface::Mesh(mesh);
    /// // It has a hole about (12, 20).
    /// assert!(plate.contact([12.0, 20.0]).is_none() && plate.contact([-20.0, -20.0]).is_some());
    /// let refused = Mesh::from_stl(b"not a mesh", &MeshOptions::default()).map_err(|error| error.to_string());
    /// assert!(refused.is_err_and(|said| said.contains("STL")));
    /// # Ok::<(), truegrind_surfaces::SurfaceError>(())
    /// ```
    ///
    /// # Errors
    /// Bytes that are not STL, a mesh without triangles or so small that its unit must be wrong, or one of which
    /// nothing is seen from above.
    pub fn from_stl(bytes: &[u8], options: &MeshOptions) -> Result<Self, SurfaceError> {
        let read = stl_io::read_stl(&mut std::io::Cursor::new(recognised(bytes)?)).map_err(|error| {
            SurfaceError::Mesh {
                problem: format!("cannot be read as STL ({error})"),
                remedy: "export it again as binary STL".to_owned(),
            }
        })?;
        // Adding 0 maps −0 to 0, so that equal corners are merged below.
        let vertices: Vec<Point3<f64>> = read
            .vertices
            .iter()
            .map(|v| Point3::from(v.0.map(|c| f64::from(c) * options.unit_mm + 0.0)))
            .collect();
        let facets = read.faces.iter().map(|f| f.vertices.map(|v| v as u32)).collect();
        Self::new(vertices, facets, options)
    }

    /// The triangles of an STL file alone, for drawing: each with its own corners, in mm by `unit_mm` along each axis. They
    /// need not form a closed surface, nor be seen from above.
    ///
    /// # Errors
    /// Bytes that are not STL, and vertices that are not finite.
    pub fn triangles_of_stl(bytes: &[u8], unit_mm: [f64; 3]) -> Result<Tessellation, SurfaceError> {
        let wrong = |problem: String| SurfaceError::Mesh {
            problem,
            remedy: "export it again as binary STL".to_owned(),
        };
        let read = stl_io::read_stl(&mut std::io::Cursor::new(recognised(bytes)?))
            .map_err(|error| wrong(format!("cannot be read as STL ({error})")))?;
        let corner = |at: usize| -> Point3<f64> {
            let v = read.vertices[at].0;
            Point3::from(std::array::from_fn::<f64, 3, _>(|k| f64::from(v[k]) * unit_mm[k]))
        };
        let mut out = Tessellation { vertices_mm: Vec::new(), normals: Vec::new(), triangles: Vec::new() };
        // A mirrored axis reverses the winding of every triangle.
        let turned = unit_mm.iter().product::<f64>() < 0.0;
        for face in &read.faces {
            let mut corners = face.vertices.map(corner);
            if turned {
                corners.swap(1, 2);
            }
            if corners.iter().any(|c| !c.iter().all(|v| v.is_finite())) {
                return Err(wrong("has a vertex that is not finite".to_owned()));
            }
            let across = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            let Some(normal) = Unit::try_new(across, 1e-12) else { continue };
            let first = out.vertices_mm.len() as u32;
            out.vertices_mm.extend(corners);
            out.normals.extend([normal; 3]);
            out.triangles.push([first, first + 1, first + 2]);
        }
        Ok(out)
    }

    /// Makes a mesh from vertices in mm and facets, three indices each, counter-clockwise seen from outside. Of
    /// `options`, the unit is not used.
    ///
    /// # Errors
    /// As [`Mesh::from_stl`]; an index beyond the vertices is one too.
    pub fn new(
        vertices: Vec<Point3<f64>>,
        facets: Vec<[u32; 3]>,
        options: &MeshOptions,
    ) -> Result<Self, SurfaceError> {
        let wrong = |problem: String, remedy: &str| SurfaceError::Mesh { problem, remedy: remedy.to_owned() };
        if let Some(at) = vertices.iter().position(|v| !v.iter().all(|c| c.is_finite())) {
            return Err(wrong(format!("has a vertex (number {at}) that is not finite"), "export it again"));
        }
        if let Some(facet) = facets.iter().flatten().find(|i| **i as usize >= vertices.len()) {
            return Err(wrong(
                format!("names the vertex {facet}, of {}", vertices.len()),
                "correct its indices",
            ));
        }
        let (vertices, facets) = joined(&vertices, &facets, options.flipped);
        if facets.is_empty() {
            return Err(wrong(
                "has no triangle with an area".to_owned(),
                "export the part's surface, not its edges",
            ));
        }
        let (low, high) = bounds(&vertices);
        let across = (high - low).amax();
        if across < MIN_SIZE_MM {
            return Err(wrong(
                format!("is only {across} mm across"),
                "STL has no unit: state unit_mm = 1000 for a file in metres, 25.4 for inches",
            ));
        }
        if !(across <= MAX_SIZE_MM && low.amax().max(high.amax()) <= MAX_SIZE_MM) {
            return Err(wrong(
                format!("is {across:e} mm across or lies as far away"),
                "check unit_mm, and that every vertex belongs to the part",
            ));
        }
        // After rounding, a vertical ray misses the exact border, so the domain ends just inside it.
        let inside = |from: f64, to: f64| [from + 1e-9 * (to - from), to - 1e-9 * (to - from)];
        let whole = Domain { first: inside(low.x, high.x), second: inside(low.y, high.y) };
        let domain = options.domain.unwrap_or(whole);
        domain.check(["x", "y"])?;
        let points = vertices.iter().map(|v| DVec3::new(v.x, v.y, v.z)).collect();
        let triangles = TriMesh::with_flags(points, facets.clone(), TriMeshFlags::ORIENTED)
            .map_err(|error| wrong(format!("makes no surface ({error})"), "repair it and export it again"))?;
        let facet_normals: Vec<_> = facets.iter().map(|f| facet_normal(&vertices, f)).collect();
        let corner_normals = corner_normals(&vertices, &facets, &facet_normals);
        let (open_edges, open_vertices) = border(vertices.len(), &facets);
        let edges = facets.iter().flat_map(|f| [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])]);
        let edge_mm = edges.map(|(a, b)| (vertices[a as usize] - vertices[b as usize]).norm()).sum::<f64>();
        let scale_mm = 2.0 * edge_mm / (3 * facets.len()) as f64;
        let stacked = stacked(&vertices, &facets, &whole);
        let mesh = Self {
            triangles: Box::new(triangles),
            domain,
            facet_normals,
            corner_normals,
            open_edges,
            open_vertices,
            scale_mm,
            stacked,
        };
        let hits = domain.lattice(40).filter_map(|plan| mesh.seen_from_above(plan)).count();
        if hits == 0 {
            return Err(wrong(
                "has no triangle below its domain".to_owned(),
                "state a domain that lies over the mesh",
            ));
        }
        if domain.lattice(40).all(|plan| mesh.contact(plan).is_none()) {
            return Err(wrong(
                "shows only the back of its triangles from above".to_owned(),
                "state flip_normal = true, or turn the part so that the side to be ground is up",
            ));
        }
        Ok(mesh)
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.triangles.num_triangles()
    }

    /// First intersection of a ray with the mesh, on either side of a triangle.
    pub fn ray(&self, origin: &Point3<f64>, direction: &Unit<Vector3<f64>>) -> Option<Contact> {
        let ray = Ray::new(
            DVec3::new(origin.x, origin.y, origin.z),
            DVec3::new(direction.x, direction.y, direction.z),
        );
        let hit = self.triangles.cast_local_ray_and_get_normal(&ray, f64::MAX, false)?;
        let at = origin + direction.into_inner() * hit.time_of_impact;
        let facet = hit.subshape;
        Some(Contact { plan: [at.x, at.y], position_mm: at, normal: self.blended_normal(facet, &at) })
    }

    /// Distance of a point from the mesh in mm, negative inside (behind the triangles).
    pub fn signed_distance_mm(&self, point: &Point3<f64>) -> f64 {
        let (projection, _) =
            self.triangles.project_local_point_and_get_location(DVec3::new(point.x, point.y, point.z), false);
        let away = point - point_of(projection.point);
        if projection.is_inside { -away.norm() } else { away.norm() }
    }

    /// A walk down the tree of boxes, and all triangles that a vertical ray meets there.
    pub(crate) fn evaluation_cost(&self) -> f64 {
        50.0 + 20.0 * (self.stacked + (self.triangle_count() as f64).log2())
    }

    pub(crate) fn domain(&self) -> Domain {
        self.domain
    }

    /// The first intersection of a vertical ray from above, unless that is the back of a triangle.
    pub(crate) fn contact(&self, plan: [f64; 2]) -> Option<Contact> {
        self.seen_from_above(plan)
            .filter(|(facet, _)| self.facet_normals[*facet].z > 0.0)
            .map(|(_, contact)| contact)
    }

    pub(crate) fn foot(&self, point: &Point3<f64>) -> Option<Foot> {
        let (projection, (facet, location)) =
            self.triangles.project_local_point_and_get_location(DVec3::new(point.x, point.y, point.z), false);
        let at = point_of(projection.point);
        let contact =
            Contact { plan: [at.x, at.y], position_mm: at, normal: self.blended_normal(facet, &at) };
        let facet = facet as usize;
        let beyond = match location {
            TrianglePointLocation::OnVertex(corner) => {
                self.open_vertices[self.triangles.indices()[facet][corner as usize] as usize]
            }
            TrianglePointLocation::OnEdge(edge, _) => self.open_edges[facet][edge as usize],
            TrianglePointLocation::OnFace(..) | TrianglePointLocation::OnSolid => false,
        };
        if beyond {
            // Beyond the border the distance is no deviation; its component along the border facet's normal
            // is.
            let normal = self.facet_normals[facet];
            return Foot::over(Contact { normal, ..contact }, point).map(|foot| Foot { contact, ..foot });
        }
        let away = (point - at).norm();
        let normal_mm = if projection.is_inside { -away } else { away };
        away.is_finite().then_some(Foot { contact, normal_mm, tangential_mm: 0.0 })
    }

    /// Rotation of the smooth normal over a length of two mean edges: a mesh has no curvature of its own.
    pub(crate) fn curvature_per_mm(&self, at: &Contact, direction: &Vector3<f64>) -> f64 {
        let tangent = direction - at.normal.into_inner() * at.normal.dot(direction);
        let Some(tangent) = Unit::try_new(tangent, 1e-10 * direction.norm()) else { return 0.0 };
        let ends = [1.0, -1.0].map(|side| {
            self.foot(&(at.position_mm + tangent.into_inner() * (side * self.scale_mm)))
                .map(|foot| foot.contact)
        });
        let [Some(ahead), Some(behind)] = ends else { return 0.0 };
        let apart = tangent.dot(&(ahead.position_mm - behind.position_mm));
        if apart < 1e-6 * self.scale_mm {
            return 0.0;
        }
        tangent.dot(&(ahead.normal.into_inner() - behind.normal.into_inner())) / apart
    }

    pub(crate) fn tessellation(&self) -> Tessellation {
        let mut shown = Tessellation::default();
        for (facet, indices) in self.triangles.indices().iter().enumerate() {
            let first = shown.vertices_mm.len() as u32;
            shown.vertices_mm.extend(indices.map(|i| point_of(self.triangles.vertices()[i as usize])));
            shown.normals.extend(self.corner_normals[facet]);
            shown.triangles.push([first, first + 1, first + 2]);
        }
        shown
    }

    fn seen_from_above(&self, [x, y]: [f64; 2]) -> Option<(usize, Contact)> {
        let top = self.triangles.local_aabb().maxs.z + 1.0;
        let ray = Ray::new(DVec3::new(x, y, top), DVec3::new(0.0, 0.0, -1.0));
        let hit = self.triangles.cast_local_ray_and_get_normal(&ray, f64::MAX, false)?;
        let at = Point3::new(x, y, top - hit.time_of_impact);
        let normal = self.blended_normal(hit.subshape, &at);
        Some((hit.subshape as usize, Contact { plan: [x, y], position_mm: at, normal }))
    }

    /// The corner normals of a facet, weighted by the barycentric coordinates of a point on it.
    fn blended_normal(&self, facet: u32, at: &Point3<f64>) -> Unit<Vector3<f64>> {
        let facet = facet as usize;
        let [a, b, c] =
            self.triangles.indices()[facet].map(|i| point_of(self.triangles.vertices()[i as usize]));
        let normal = self.facet_normals[facet];
        let area = |p: &Point3<f64>, q: &Point3<f64>| normal.dot(&(p - at).cross(&(q - at))).max(0.0);
        let weights = [area(&b, &c), area(&c, &a), area(&a, &b)];
        let blended: Vector3<f64> =
            self.corner_normals[facet].iter().zip(weights).map(|(n, w)| n.into_inner() * w).sum();
        Unit::try_new(blended, f64::MIN_POSITIVE).unwrap_or(normal)
    }
}

/// The bytes in a form that the reader cannot misinterpret: a binary file must not begin with `solid`, a text file must begin
/// with `solid `.
fn recognised(bytes: &[u8]) -> Result<Vec<u8>, SurfaceError> {
    let count = bytes.get(80..84).map(|n| u64::from(u32::from_le_bytes([n[0], n[1], n[2], n[3]])));
    let length = bytes.len() as u64;
    let begins_solid = bytes.get(..5).is_some_and(|b| b.eq_ignore_ascii_case(b"solid"));
    match count {
        Some(count) if length == 84 + 50 * count => {
            let mut binary = bytes.to_vec();
            binary[..5].fill(b' ');
            Ok(binary)
        }
        _ if begins_solid => {
            let line = bytes.iter().position(|b| *b == b'\n').unwrap_or(bytes.len());
            Ok([b"solid part".as_slice(), &bytes[line..]].concat())
        }
        Some(count) => Err(SurfaceError::Mesh {
            problem: format!(
                "states {count} triangles, which take {} bytes, but has {length}",
                84 + 50 * count
            ),
            remedy: "it is cut short or no STL file; export it again".to_owned(),
        }),
        None => Err(SurfaceError::Mesh {
            problem: format!("has {length} bytes, less than the 84 of an STL header"),
            remedy: "it is cut short or no STL file; export it again".to_owned(),
        }),
    }
}

/// Vertices without duplicates, and their facets of non-zero area.
fn joined(vertices: &[Point3<f64>], facets: &[[u32; 3]], flipped: bool) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let mut indices: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    let mut kept = Vec::new();
    let indices: Vec<u32> = vertices
        .iter()
        .map(|v| {
            *indices.entry([v.x, v.y, v.z].map(|c| (c + 0.0).to_bits())).or_insert_with(|| {
                kept.push(*v);
                kept.len() as u32 - 1
            })
        })
        .collect();
    let facets = facets
        .iter()
        .map(|f| f.map(|i| indices[i as usize]))
        .map(|[a, b, c]| if flipped { [a, c, b] } else { [a, b, c] })
        .filter(|f| {
            let [a, b, c] = f.map(|i| kept[i as usize]);
            let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
            (b - a).cross(&(c - a)).norm() > 1e-9 * longest * longest
        })
        .collect();
    (kept, facets)
}

fn bounds(vertices: &[Point3<f64>]) -> (Vector3<f64>, Vector3<f64>) {
    let start = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    vertices.iter().fold(start, |(low, high), v| (low.inf(&v.coords), high.sup(&v.coords)))
}

/// Mean number of triangles whose box covers a place of the whole domain.
fn stacked(vertices: &[Point3<f64>], facets: &[[u32; 3]], whole: &Domain) -> f64 {
    let side = |[from, to]: [f64; 2]| (to - from).max(f64::MIN_POSITIVE);
    let boxes = facets.iter().map(|facet| {
        let corners = facet.map(|i| vertices[i as usize]);
        let extent = |k: usize| {
            let [low, high] = statistics::extent(corners.iter().map(|corner| corner[k]));
            high - low
        };
        (extent(0) / side(whole.first)).min(1.0) * (extent(1) / side(whole.second)).min(1.0)
    });
    boxes.sum()
}

fn facet_normal(vertices: &[Point3<f64>], facet: &[u32; 3]) -> Unit<Vector3<f64>> {
    let [a, b, c] = facet.map(|i| vertices[i as usize]);
    Unit::new_normalize((b - a).cross(&(c - a)))
}

/// At each corner, the normals of the facets around it that meet this facet without a crease, weighted by their angle there.
fn corner_normals(
    vertices: &[Point3<f64>],
    facets: &[[u32; 3]],
    normals: &[Unit<Vector3<f64>>],
) -> Vec<[Unit<Vector3<f64>>; 3]> {
    let mut around: Vec<Vec<(usize, f64)>> = vec![Vec::new(); vertices.len()];
    for (facet, indices) in facets.iter().enumerate() {
        for corner in 0..3 {
            let [at, next, previous] = [0, 1, 2].map(|k| vertices[indices[(corner + k) % 3] as usize]);
            around[indices[corner] as usize].push((facet, (next - at).angle(&(previous - at))));
        }
    }
    let smooth = |facet: usize, vertex: u32| {
        let own = normals[facet];
        let sum: Vector3<f64> = around[vertex as usize]
            .iter()
            .filter(|(other, _)| normals[*other].dot(&own) >= CREASE_RAD.cos())
            .map(|(other, angle)| normals[*other].into_inner() * *angle)
            .sum();
        Unit::try_new(sum, f64::MIN_POSITIVE).unwrap_or(own)
    };
    facets.iter().enumerate().map(|(facet, indices)| indices.map(|vertex| smooth(facet, vertex))).collect()
}

/// Which edges of each facet, and which vertices, lie on the border.
fn border(vertex_count: usize, facets: &[[u32; 3]]) -> (Vec<[bool; 3]>, Vec<bool>) {
    let edges = |f: &[u32; 3]| [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])].map(|(a, b)| (a.min(b), a.max(b)));
    let mut count: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for edge in facets.iter().flat_map(edges) {
        *count.entry(edge).or_default() += 1;
    }
    let open: Vec<[bool; 3]> = facets.iter().map(|f| edges(f).map(|edge| count[&edge] == 1)).collect();
    let mut open_vertices = vec![false; vertex_count];
    for ((a, b), _) in count.iter().filter(|(_, n)| **n == 1) {
        open_vertices[*a as usize] = true;
        open_vertices[*b as usize] = true;
    }
    (open, open_vertices)
}

fn point_of(v: DVec3) -> Point3<f64> {
    Point3::new(v.x, v.y, v.z)
}
