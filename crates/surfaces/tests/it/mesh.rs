use nalgebra::{Point3, Unit, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind_surfaces::mesh::{Mesh, MeshOptions};
use truegrind_surfaces::{Domain, Surface, sample};

use super::mesh_of;

type Facet = [[f64; 3]; 3];

fn binary(facets: &[Facet], header: &[u8]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        bytes.extend([0; 12]);
        for c in facet.iter().flatten() {
            bytes.extend((*c as f32).to_le_bytes());
        }
        bytes.extend([0, 0]);
    }
    bytes
}

fn text(facets: &[Facet], header: &str) -> Vec<u8> {
    let mut text = format!("{header}\n");
    for facet in facets {
        text += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in facet {
            text += &format!("vertex {x} {y} {z}\n");
        }
        text += "endloop\nendfacet\n";
    }
    (text + "endsolid\n").into_bytes()
}

/// A ball in rings of longitude and latitude, wound outward.
fn ball(radius: f64, rings: usize) -> Vec<Facet> {
    let at = |i: usize, k: usize| {
        let polar = std::f64::consts::PI * i as f64 / rings as f64;
        let turn = std::f64::consts::TAU * (k % (2 * rings)) as f64 / (2 * rings) as f64;
        // The poles and the seam are joined exactly only if they are written alike.
        let s = if i == 0 || i == rings { 0.0 } else { polar.sin() };
        [radius * s * turn.cos(), radius * s * turn.sin(), radius * polar.cos()]
    };
    let cells = (0..rings).flat_map(|i| (0..2 * rings).map(move |k| (i, k)));
    cells
        .flat_map(|(i, k)| {
            [[at(i, k), at(i + 1, k), at(i + 1, k + 1)], [at(i, k), at(i + 1, k + 1), at(i, k + 1)]]
        })
        .collect()
}

/// The plate that ships: a wavy sheet of 4 mm cells with a round hole.
fn plate() -> Vec<u8> {
    let (nx, ny, cell) = (25, 35, 4.0);
    let at = |i: usize, k: usize| {
        let (x, y) = (cell * i as f64 - 50.0, cell * k as f64 - 70.0);
        [x, y, 3.0 * (x / 25.0).sin() + 2.0 * (y / 35.0).cos()]
    };
    let mut facets = Vec::new();
    for (i, k) in (0..nx).flat_map(|i| (0..ny).map(move |k| (i, k))) {
        let (x, y) = (cell * (i as f64 + 0.5) - 50.0, cell * (k as f64 + 0.5) - 70.0);
        if (x - 12.0_f64).hypot(y - 20.0) > 14.0 {
            facets.push([at(i, k), at(i + 1, k), at(i + 1, k + 1)]);
            facets.push([at(i, k), at(i + 1, k + 1), at(i, k + 1)]);
        }
    }
    binary(&facets, b"wavy plate with a hole, truegrind sample")
}

#[test]
fn the_plate_that_ships_is_what_its_recipe_makes() {
    // f32 coordinates: the last bit of sin and cos may differ between machines, no more.
    let (made, ships) = (mesh_of(&plate()), mesh_of(sample::PLATE_STL));
    assert!(sample::PLATE_STL.len() < 100_000);
    assert_eq!(made.triangle_count(), ships.triangle_count());
    let (made, ships) = (Surface::Mesh(made).tessellate(1), Surface::Mesh(ships).tessellate(1));
    for (a, b) in made.vertices_mm.iter().zip(&ships.vertices_mm) {
        assert!((a - b).norm() < 1e-5);
    }
}

#[test]
fn distances_from_a_faceted_ball_are_true_within_its_facets() {
    let (radius, rings) = (60.0, 32);
    let mesh = mesh_of(&binary(&ball(radius, rings), b"ball"));
    let surface = Surface::Mesh(mesh.clone());
    // A facet's middle lies deeper than its corners by at most r (1 − cos of half its widest angle at the centre).
    let sag = radius * (1.0 - (0.75 * std::f64::consts::PI / rings as f64).cos());
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for _ in 0..300 {
        let out = Vector3::from_fn(|_, _| random.random_range(-1.0..1.0_f64)).normalize();
        let height = random.random_range(-20.0..20.0);
        let point = Point3::from(out * (radius + height));
        let distance = mesh.signed_distance_mm(&point);
        assert!(distance > height - 1e-4 && distance < height + sag, "{distance} {height} {sag}");
        let foot = surface.foot(&point).unwrap();
        assert_eq!(foot.normal_mm, distance);
        assert!(foot.contact.normal.angle(&out) < 0.02, "{}", foot.contact.normal.angle(&out));
        assert!((foot.contact.position_mm.coords.norm() - radius).abs() < sag);
    }
    assert!(mesh.signed_distance_mm(&Point3::origin()) < -radius + sag);
}

#[test]
fn rays_meet_the_ball_where_geometry_says() {
    let mesh = mesh_of(&binary(&ball(60.0, 32), b"ball"));
    let top = Surface::Mesh(mesh.clone()).contact([20.0, -10.0]).unwrap();
    assert!((top.position_mm.z - 3100_f64.sqrt()).abs() < 0.4 && top.normal.z > 0.9);
    let origin = Point3::new(-200.0, 3.0, 4.0);
    let hit = mesh.ray(&origin, &Vector3::x_axis()).unwrap();
    assert!((hit.position_mm.x + (3600.0_f64 - 25.0).sqrt()).abs() < 0.4, "{hit:?}");
    assert!((hit.normal.into_inner() - hit.position_mm.coords.normalize()).norm() < 0.02);
    assert!(mesh.ray(&origin, &Unit::new_normalize(Vector3::new(-1.0, 0.0, 0.0))).is_none());
    let bent = Surface::Mesh(mesh).curvature_per_mm(&top, &Vector3::new(1.0, 1.0, 0.0));
    assert!((bent - 1.0 / 60.0).abs() < 0.002, "{bent}");
}

/// A box without a lid would not do: 12 triangles, wound outward.
fn cuboid(half: [f64; 3]) -> Vec<Facet> {
    let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { half[axis] } else { -half[axis] });
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    sides.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).map(|f| f.map(corner)).collect()
}

#[test]
fn normals_do_not_blend_across_a_crease() {
    let mesh = mesh_of(&binary(&cuboid([20.0, 15.0, 10.0]), b"box"));
    let surface = Surface::Mesh(mesh.clone());
    for plan in [[19.9, 0.0], [-19.9, 14.9], [0.0, 0.0]] {
        let contact = surface.contact(plan).unwrap();
        assert_eq!(contact.position_mm.z, 10.0);
        assert!((contact.normal.z - 1.0).abs() < 1e-12, "{:?}", contact.normal);
    }
    for (point, distance) in [
        ([0.0, 0.0, 12.0], 2.0),
        ([0.0, 0.0, 9.0], -1.0),
        ([23.0, 19.0, 0.0], 5.0),
        ([23.0, 19.0, 22.0], 13.0),
        ([0.0, -14.0, 0.0], -1.0),
    ] {
        assert!((mesh.signed_distance_mm(&Point3::from(point)) - distance).abs() < 1e-9, "{point:?}");
    }
}

#[test]
fn beyond_an_open_border_the_part_along_the_normal_is_the_deviation() {
    let sheet = [
        [[0.0, 0.0, 5.0], [40.0, 0.0, 5.0], [40.0, 30.0, 5.0]],
        [[0.0, 0.0, 5.0], [40.0, 30.0, 5.0], [0.0, 30.0, 5.0]],
    ];
    let surface = Surface::Mesh(mesh_of(&binary(&sheet, b"sheet")));
    for (point, normal_mm, tangential_mm) in
        [([43.0, 10.0, 5.5], 0.5, 3.0), ([-3.0, -4.0, 4.0], -1.0, 5.0), ([10.0, 7.5, 6.0], 1.0, 0.0)]
    {
        let foot = surface.foot(&Point3::from(point)).unwrap();
        assert!(
            (foot.normal_mm - normal_mm).abs() < 1e-12 && (foot.tangential_mm - tangential_mm).abs() < 1e-12,
            "{foot:?}"
        );
    }
}

#[test]
fn text_binary_and_mislabelled_files_read_alike() {
    let facets = cuboid([20.0, 15.0, 10.0]);
    let files = [
        binary(&facets, b"box"),
        binary(&facets, b"solid box exported by a program that should know better"),
        text(&facets, "solid box"),
        text(&facets, "solid"),
        text(&facets, "SOLID box\r"),
    ];
    for file in files {
        let shown = Surface::Mesh(mesh_of(&file)).tessellate(1);
        assert_eq!(shown.triangles.len(), 12);
        assert_eq!(shown.vertices_mm[0], Point3::new(-20.0, -15.0, -10.0));
    }
}

#[test]
fn units_and_winding_are_as_stated() {
    let inches = binary(&cuboid([2.0, 1.0, 0.5]), b"box");
    let options = MeshOptions { unit_mm: 25.4, ..Default::default() };
    let mesh = Mesh::from_stl(&inches, &options).unwrap();
    assert!((mesh.signed_distance_mm(&Point3::new(0.0, 0.0, 13.7)) - 1.0).abs() < 1e-9);
    let turned: Vec<Facet> = cuboid([20.0, 15.0, 10.0]).into_iter().map(|[a, b, c]| [a, c, b]).collect();
    let options = MeshOptions { flipped: true, ..Default::default() };
    let mesh = Mesh::from_stl(&binary(&turned, b"box"), &options).unwrap();
    assert!((mesh.signed_distance_mm(&Point3::new(0.0, 0.0, 12.0)) - 2.0).abs() < 1e-12);
}

#[test]
fn what_is_no_mesh_is_refused_with_a_remedy() {
    let good = binary(&cuboid([20.0, 15.0, 10.0]), b"box");
    let mut not_finite = good.clone();
    not_finite[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    let turned: Vec<Facet> = cuboid([20.0, 15.0, 10.0]).into_iter().map(|[a, b, c]| [a, c, b]).collect();
    let line = [[[0.0; 3], [10.0, 0.0, 0.0], [20.0, 0.0, 0.0]]];
    let aside = Domain { first: [100.0, 110.0], second: [0.0, 10.0] };
    let cases: Vec<(Vec<u8>, Option<Domain>, &str)> = vec![
        (Vec::new(), None, "0 bytes, less than the 84"),
        (good[..300].to_vec(), None, "states 12 triangles, which take 684 bytes, but has 300"),
        (b"<html>not found</html>".to_vec(), None, "less than the 84"),
        (
            b"solid box\nfacet normal 0 0 1\nouter loop\nvertex 1 2 x\n".to_vec(),
            None,
            "cannot be read as STL",
        ),
        (b"solid box\nendsolid box\n".to_vec(), None, "no triangle with an area"),
        (binary(&[], b"nothing"), None, "no triangle with an area"),
        (binary(&line, b"line"), None, "no triangle with an area"),
        (not_finite, None, "not finite"),
        (binary(&cuboid([0.05, 0.04, 0.02]), b"metres"), None, "unit_mm = 1000"),
        (binary(&turned, b"inside out"), None, "flip_normal = true"),
        (good.clone(), Some(aside), "no triangle below its domain"),
    ];
    for (bytes, domain, part) in cases {
        let made = Mesh::from_stl(&bytes, &MeshOptions { domain, ..Default::default() });
        let message = made.unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
    let options = MeshOptions::default();
    let beyond = Mesh::new(vec![Point3::origin(); 3], vec![[0, 1, 7]], &options).unwrap_err().to_string();
    assert!(beyond.contains("vertex 7, of 3"), "{beyond}");
}
