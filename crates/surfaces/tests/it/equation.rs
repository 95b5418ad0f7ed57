use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind_math::difference;
use truegrind_surfaces::{Contact, Domain, Explicit, Implicit, Parametric, Surface, SurfaceError};

use super::{explicit, implicit, parametric, square};

/// One smooth surface in three forms.
fn three_forms() -> [Surface; 3] {
    let domain = Domain { first: [-40.0, 40.0], second: [-30.0, 30.0] };
    let z = "4*sin(x/20)*cos(y/25) + x*y/300";
    [
        explicit(z, domain),
        parametric(["u", "v", &z.replace('x', "u").replace('y', "v")], domain),
        implicit(&format!("z - ({z})"), domain, [-20.0, 20.0]),
    ]
}

fn places(seed: u64, count: usize, domain: Domain) -> Vec<[f64; 2]> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..count)
        .map(|_| domain.at([random.random_range(0.02..0.98), random.random_range(0.02..0.98)]))
        .collect()
}

/// The derivatives of position and of normal along the plan.
fn twin(surface: &Surface, plan: [f64; 2]) -> (nalgebra::DMatrix<f64>, nalgebra::DMatrix<f64>) {
    let domain = surface.domain();
    let steps = [1e-3 * (domain.first[1] - domain.first[0]), 1e-3 * (domain.second[1] - domain.second[0])];
    let at = |p: &[f64]| surface.contact([p[0], p[1]]).unwrap();
    let position = difference::jacobian(
        |p, out| out.copy_from_slice(at(p).position_mm.coords.as_slice()),
        &plan,
        3,
        &steps,
    );
    let normal =
        difference::jacobian(|p, out| out.copy_from_slice(at(p).normal.as_slice()), &plan, 3, &steps);
    (position, normal)
}

#[test]
fn normals_and_curvatures_have_a_numerical_twin() {
    let ball = parametric(["50*sin(u)*cos(v)", "50*sin(v)", "50*cos(u)*cos(v)"], square(0.6));
    for surface in three_forms().into_iter().chain([ball]) {
        for plan in places(1, 25, surface.domain()) {
            let contact = surface.contact(plan).unwrap();
            let (position, normal) = twin(&surface, plan);
            let (first, second) = (position.column(0).into_owned(), position.column(1).into_owned());
            let product = Vector3::from_column_slice(first.as_slice())
                .cross(&Vector3::from_column_slice(second.as_slice()))
                .normalize();
            assert!((product - contact.normal.into_inner()).norm() < 1e-8, "{plan:?}: {product}");
            // Normal curvature is how the normal turns along a tangent.
            for mix in [[1.0, 0.0], [0.0, 1.0], [0.6, -0.8]] {
                let tangent = Vector3::from_column_slice((&first * mix[0] + &second * mix[1]).as_slice());
                let turn = Vector3::from_column_slice(
                    (normal.column(0) * mix[0] + normal.column(1) * mix[1]).as_slice(),
                );
                let expected = turn.dot(&tangent) / tangent.norm_squared();
                let lifted = tangent * 3.0 + contact.normal.into_inner() * 2.0;
                let found = surface.curvature_per_mm(&contact, &lifted);
                assert!((found - expected).abs() < 1e-7, "{plan:?}: {found}, not {expected}");
            }
            assert_eq!(surface.curvature_per_mm(&contact, &contact.normal), 0.0);
        }
    }
}

#[test]
fn the_same_surface_in_three_forms_agrees() {
    let forms = three_forms();
    let mut random = ChaCha8Rng::seed_from_u64(2);
    for plan in places(3, 60, forms[0].domain()) {
        let [a, b, c] = forms.each_ref().map(|surface| surface.contact(plan).unwrap());
        for other in [b, c] {
            assert!((a.position_mm - other.position_mm).norm() < 1e-10, "{plan:?}");
            assert!((a.normal.into_inner() - other.normal.into_inner()).norm() < 1e-10, "{plan:?}");
        }
        let height = random.random_range(-3.0..3.0);
        let point = a.position_mm + a.normal.into_inner() * height;
        for surface in &forms {
            let foot = surface.foot(&point).unwrap();
            assert!((foot.normal_mm - height).abs() < 1e-9, "{surface:?}: {} not {height}", foot.normal_mm);
            assert!(foot.tangential_mm < 1e-7, "{}", foot.tangential_mm);
            assert!((foot.contact.position_mm - a.position_mm).norm() < 1e-7);
            assert_eq!(surface.deviation_mm(&point), Some(foot.normal_mm));
        }
    }
}

#[test]
fn distances_from_a_ball_are_those_of_geometry() {
    let r = 80.0;
    let balls = [
        explicit("sqrt(80^2 - x^2 - y^2)", square(40.0)),
        parametric(["80*sin(u)*cos(v)", "80*sin(v)", "80*cos(u)*cos(v)"], square(0.5)),
        implicit("x^2 + y^2 + z^2 - 80^2", square(40.0), [10.0, 100.0]),
        // The same, with the sign of F turned round.
        implicit("80^2 - x^2 - y^2 - z^2", square(40.0), [10.0, 100.0]),
    ];
    for ball in balls {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        for _ in 0..60 {
            let (u, v): (f64, f64) = (random.random_range(-0.4..0.4), random.random_range(-0.4..0.4));
            let out = Vector3::new(u.sin() * v.cos(), v.sin(), u.cos() * v.cos());
            let height = random.random_range(-40.0..60.0);
            let foot = ball.foot(&Point3::from(out * (r + height))).unwrap();
            assert!((foot.normal_mm - height).abs() < 1e-8, "{ball:?}: {} not {height}", foot.normal_mm);
            assert!((foot.contact.normal.into_inner() - out).norm() < 1e-8);
            let bent = ball.curvature_per_mm(&foot.contact, &Vector3::new(1.0, 2.0, 0.5));
            assert!((bent - 1.0 / r).abs() < 1e-10, "{bent}");
        }
    }
}

#[test]
fn beyond_the_border_the_part_along_the_normal_is_the_deviation() {
    let plane = explicit("0", square(10.0));
    let foot = plane.foot(&Point3::new(13.0, 4.0, 0.25)).unwrap();
    assert_eq!(foot.contact.plan, [10.0, 4.0]);
    assert!((foot.normal_mm - 0.25).abs() < 1e-12 && (foot.tangential_mm - 3.0).abs() < 1e-12);
    let corner = plane.foot(&Point3::new(-13.0, 14.0, -1.0)).unwrap();
    assert_eq!(corner.contact.plan, [-10.0, 10.0]);
    assert!((corner.tangential_mm - 5.0).abs() < 1e-12 && (corner.normal_mm + 1.0).abs() < 1e-12);
    assert_eq!(plane.foot(&Point3::new(f64::NAN, 0.0, 0.0)), None);
}

#[test]
fn flipping_turns_normal_deviation_and_curvature_round() {
    let xyz = ["50*sin(u)*cos(v)", "50*sin(v)", "50*cos(u)*cos(v)"];
    let [out, into] =
        [false, true].map(|flip| Surface::Parametric(Parametric::new(xyz, square(0.5), flip).unwrap()));
    let point = Point3::new(3.0, 4.0, 52.0);
    assert!((out.deviation_mm(&point).unwrap() + into.deviation_mm(&point).unwrap()).abs() < 1e-12);
    let bent = |s: &Surface| s.curvature_per_mm(&s.contact([0.1, 0.2]).unwrap(), &Vector3::x());
    assert!((bent(&out) - 0.02).abs() < 1e-12 && (bent(&into) + 0.02).abs() < 1e-12);
}

#[test]
fn an_implicit_surface_is_seen_from_above() {
    // Two balls one above the other: the upper one hides the lower one, and beside it there is nothing.
    let f = "(x^2 + y^2 + (z - 30)^2 - 100)*(x^2 + y^2 + (z + 30)^2 - 400)";
    let balls = implicit(f, square(25.0), [-60.0, 60.0]);
    assert!((balls.contact([0.0, 0.0]).unwrap().position_mm.z - 40.0).abs() < 1e-9);
    assert!((balls.contact([15.0, 0.0]).unwrap().position_mm.z - (-30.0 + 175_f64.sqrt())).abs() < 1e-9);
    assert_eq!(balls.contact([24.0, 0.0]), None);
    assert!(balls.contact([0.0, 0.0]).unwrap().normal.z > 0.999);
}

#[test]
fn what_makes_no_surface_is_refused_with_its_place() {
    let wide = square(10.0);
    let turned = Domain { first: [5.0, -5.0], second: [-1.0, 1.0] };
    let nan = Domain { first: [-1.0, 1.0], second: [0.0, f64::NAN] };
    let cases: Vec<(Result<(), SurfaceError>, &str)> = vec![
        (Explicit::new("sqrt(x)", wide).map(drop), "x = -10"),
        (Explicit::new("1/y", wide).map(drop), "y = 0"),
        (Explicit::new("x", turned).map(drop), "range of x is 5 to -5"),
        (Explicit::new("x", nan).map(drop), "range of y"),
        (
            Parametric::new(["sin(u)*cos(v)", "sin(u)*sin(v)", "cos(u)"], square(1.0), false).map(drop),
            "without a normal",
        ),
        (Parametric::new(["u", "2*u", "u"], wide, false).map(drop), "without a normal"),
        (Parametric::new(["u", "v", "w"], wide, false).map(drop), "unknown name `w`"),
        (Implicit::new("x^2 + y^2 + z^2 + 1", wide, [-5.0, 5.0]).map(drop), "no point in the domain"),
        (Implicit::new("z - ln(x)", wide, [-5.0, 5.0]).map(drop), "x = -10"),
        (Implicit::new("z", wide, [5.0, 5.0]).map(drop), "range of z"),
    ];
    for (made, part) in cases {
        let message = made.unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn triangles_cover_the_surface_and_face_outward() {
    for surface in three_forms() {
        let shown = surface.tessellate(24);
        assert_eq!((shown.vertices_mm.len(), shown.normals.len(), shown.triangles.len()), (625, 625, 1152));
        let mut plan_area = 0.0;
        for triangle in &shown.triangles {
            let [a, b, c] = triangle.map(|i| shown.vertices_mm[i as usize]);
            let product = (b - a).cross(&(c - a));
            assert!(product.dot(&shown.normals[triangle[0] as usize]) > 0.0);
            plan_area += 0.5 * product.z;
        }
        assert!((plan_area - 80.0 * 60.0).abs() < 1e-6, "{plan_area}");
        for (vertex, normal) in shown.vertices_mm.iter().zip(&shown.normals) {
            let Contact { normal: expected, .. } = surface.foot(vertex).unwrap().contact;
            assert!((normal.into_inner() - expected.into_inner()).norm() < 1e-6);
        }
    }
    let ball = implicit("x^2 + y^2 + z^2 - 100", square(12.0), [0.0, 20.0]);
    let shown = ball.tessellate(20);
    assert!(
        shown.vertices_mm.len() < 441
            && shown.triangles.iter().flatten().all(|i| (*i as usize) < shown.vertices_mm.len())
    );
}
