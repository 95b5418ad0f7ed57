use nalgebra::{Point3, Vector3};
use truegrind_surfaces::path::{self, Along, PathOptions, Pattern, Spacing, ToolX, Traverse};
use truegrind_surfaces::sampling::beside_chord_mm;
use truegrind_surfaces::{Domain, PathPoint, PointKind, Surface, SurfaceError, sample};

use super::{explicit, implicit, parametric, square};

fn wave() -> Surface {
    let domain = Domain { first: [-40.0, 40.0], second: [-30.0, 30.0] };
    explicit("4*sin(x/20)*cos(y/25) + x*y/300", domain)
}

fn ball() -> Surface {
    parametric(["90*sin(u)*cos(v)", "90*sin(v)", "90*cos(u)*cos(v)"], square(0.4))
}

fn every_option() -> Vec<PathOptions> {
    let step_over = Spacing::StepOver { step_over_mm: 8.0 };
    let scallop = Spacing::Scallop { scallop_mm: 0.4, tool_radius_mm: 15.0 };
    let fixed = ToolX::Fixed(Vector3::new(-1.0, 0.2, 0.0));
    let steps =
        PathOptions { max_step_mm: 4.0, chord_mm: 0.02, lead_rad: 0.2, tilt_rad: -0.3, ..Default::default() };
    let with = |pattern, along, traverse, spacing, tool_x| PathOptions {
        pattern,
        along,
        traverse,
        spacing,
        tool_x,
        ..steps
    };
    vec![
        with(Pattern::Raster, Along::First, Traverse::Zigzag, step_over, fixed),
        with(Pattern::Raster, Along::Second, Traverse::OneWay, scallop, ToolX::Feed),
        with(Pattern::Raster, Along::First, Traverse::OneWay, scallop, fixed),
        with(Pattern::Spiral, Along::First, Traverse::Zigzag, step_over, ToolX::Feed),
        with(Pattern::Spiral, Along::First, Traverse::Zigzag, scallop, fixed),
        with(Pattern::Contour, Along::First, Traverse::Zigzag, step_over, fixed),
        with(Pattern::Contour, Along::First, Traverse::Zigzag, scallop, ToolX::Feed),
    ]
}

/// The cuts of each pass.
fn passes(points: &[PathPoint]) -> Vec<Vec<PathPoint>> {
    let count = points.iter().map(|p| p.pass + 1).max().unwrap_or(0);
    let cuts = |pass| points.iter().copied().filter(move |p| p.kind == PointKind::Cut && p.pass == pass);
    (0..count).map(|pass| cuts(pass).collect()).collect()
}

/// Distance of a point from a polyline.
fn from_polyline(point: &Point3<f64>, line: &[PathPoint]) -> f64 {
    line.windows(2)
        .map(|w| beside_chord_mm(point, &w[0].position_mm, &w[1].position_mm))
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn frames_are_right_handed_and_stand_at_the_stated_angles() {
    for surface in [wave(), ball()] {
        for options in every_option() {
            for point in path::over(&surface, &options).unwrap() {
                let matrix = point.orientation.to_rotation_matrix().into_inner();
                assert!((matrix.determinant() - 1.0).abs() < 1e-12);
                assert!((matrix.transpose() * matrix - nalgebra::Matrix3::identity()).norm() < 1e-12);
                if point.kind == PointKind::Link {
                    continue;
                }
                let (normal, z) = (point.normal.into_inner(), point.tool_z().into_inner());
                let upright = -options.lead_rad.cos() * options.tilt_rad.cos();
                assert!((z.dot(&normal) - upright).abs() < 1e-12, "{options:?}");
                assert!(point.feed.dot(&normal).abs() < 1e-9);
                if options.pattern != Pattern::Contour {
                    // Lead leans the spindle, −z, towards the feed, tilt to its left.
                    let left = normal.cross(&point.feed);
                    assert!((-z.dot(&point.feed) - options.lead_rad.sin()).abs() < 1e-9);
                    assert!((-z.dot(&left) - options.lead_rad.cos() * options.tilt_rad.sin()).abs() < 1e-9);
                    if options.tool_x == ToolX::Feed {
                        let x = point.orientation * Vector3::x();
                        assert!((x.dot(&point.feed) - options.lead_rad.cos()).abs() < 1e-9);
                    }
                }
                if let ToolX::Fixed(direction) = options.tool_x {
                    let (x, y) = (point.orientation * Vector3::x(), point.orientation * Vector3::y());
                    assert!(y.dot(&direction).abs() < 1e-9 && x.dot(&direction) > 0.0);
                }
                let pose = point.work_object_from_tool();
                assert_eq!(pose.translation.vector, point.position_mm.coords);
            }
        }
    }
}

#[test]
fn without_lead_and_tilt_the_tool_points_straight_in_and_x_is_the_feed() {
    let options = PathOptions { tool_x: ToolX::Feed, ..Default::default() };
    for point in path::over(&wave(), &options).unwrap().iter().filter(|p| p.kind == PointKind::Cut) {
        assert!((point.tool_z().into_inner() + point.normal.into_inner()).norm() < 1e-12);
        assert!((point.orientation * Vector3::x() - point.feed.into_inner()).norm() < 1e-9);
    }
}

#[test]
fn steps_and_chord_errors_stay_within_their_bounds() {
    for surface in [wave(), ball()] {
        for options in every_option() {
            for pass in passes(&path::over(&surface, &options).unwrap()) {
                for pair in pass.windows(2) {
                    let (a, b) = (pair[0].position_mm, pair[1].position_mm);
                    let length = (b - a).norm();
                    assert!(length > 0.0 && length <= options.max_step_mm + 1e-9, "{length} {options:?}");
                    // How far the surface lies from the middle of the chord, which the curve bounds.
                    for part in [0.25, 0.5, 0.75] {
                        let away = surface.deviation_mm(&(a + (b - a) * part)).unwrap().abs();
                        assert!(away <= 1.03 * options.chord_mm, "{away} {options:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_chord_error_alone_decides_where_steps_may_be_long() {
    // On a cylinder of radius 50 across its axis, a chord error c allows steps of 2√(2rc − c²).
    let cylinder =
        parametric(["v", "50*sin(u)", "50*cos(u)"], Domain { first: [-0.7, 0.7], second: [0.0, 20.0] });
    let chord_mm: f64 = 0.01;
    let options = PathOptions { chord_mm, max_step_mm: 100.0, ..Default::default() };
    let longest = 2.0 * (2.0 * 50.0 * chord_mm - chord_mm * chord_mm).sqrt();
    let exact = (1.4 / (2.0 * (0.5 * longest / 50.0_f64).asin())).ceil() as usize;
    for pass in passes(&path::over(&cylinder, &options).unwrap()) {
        let steps = pass.len() - 1;
        assert!(steps >= exact && steps <= exact + 2, "{steps} steps, {exact} would do");
    }
}

#[test]
fn neighbouring_passes_are_no_farther_apart_than_the_step_over() {
    for surface in [wave(), ball()] {
        for (along, step_over_mm) in [(Along::First, 6.0), (Along::Second, 2.5)] {
            let spacing = Spacing::StepOver { step_over_mm };
            let options =
                PathOptions { along, spacing, max_step_mm: 2.0, chord_mm: 0.01, ..Default::default() };
            let passes = passes(&path::over(&surface, &options).unwrap());
            let mut widest: f64 = 0.0;
            for pair in passes.windows(2) {
                for point in &pair[0] {
                    widest = widest.max(from_polyline(&point.position_mm, &pair[1]));
                }
            }
            assert!(widest <= 1.001 * step_over_mm && widest > 0.8 * step_over_mm, "{widest} {step_over_mm}");
        }
    }
}

#[test]
fn no_place_is_farther_than_half_a_step_over_from_a_pass() {
    let spacing = Spacing::StepOver { step_over_mm: 5.0 };
    for (surface, pattern) in [
        (wave(), Pattern::Raster),
        (ball(), Pattern::Raster),
        (wave(), Pattern::Contour),
        (ball(), Pattern::Contour),
        (wave(), Pattern::Spiral),
        (ball(), Pattern::Spiral),
    ] {
        let options = PathOptions { pattern, spacing, max_step_mm: 2.0, ..Default::default() };
        let passes = passes(&path::over(&surface, &options).unwrap());
        let domain = surface.domain();
        let mut farthest: f64 = 0.0;
        for (i, k) in (0..=30).flat_map(|i| (0..=30).map(move |k| (i, k))) {
            let share = [i as f64 / 30.0, k as f64 / 30.0];
            // A spiral covers the ellipse.
            if pattern == Pattern::Spiral && (2.0 * share[0] - 1.0).hypot(2.0 * share[1] - 1.0) > 1.0 {
                continue;
            }
            let place = surface.contact(domain.at(share)).unwrap().position_mm;
            farthest =
                farthest.max(passes.iter().map(|p| from_polyline(&place, p)).fold(f64::INFINITY, f64::min));
        }
        // A corner of a contour is cut off by no more than the diagonal.
        let bound = if pattern == Pattern::Contour { 2.5 * 2_f64.sqrt() } else { 2.5 };
        assert!(farthest <= 1.03 * bound, "{pattern:?}: {farthest}");
    }
}

#[test]
fn the_raster_reaches_all_four_borders() {
    let surface = wave();
    let domain = surface.domain();
    for along in [Along::First, Along::Second] {
        let points = path::over(&surface, &PathOptions { along, ..Default::default() }).unwrap();
        let cuts = points.iter().filter(|p| p.kind == PointKind::Cut);
        let range = |i: usize| {
            cuts.clone()
                .map(|p| p.position_mm[i])
                .fold([f64::MAX, f64::MIN], |[a, b], c| [a.min(c), b.max(c)])
        };
        assert_eq!([range(0), range(1)], [domain.first, domain.second]);
    }
}

#[test]
fn a_scallop_is_as_high_as_stated_between_two_passes_of_a_ball() {
    let (scallop_mm, radius) = (0.05, 8.0);
    let spacing = Spacing::Scallop { scallop_mm, tool_radius_mm: radius };
    let options = PathOptions { spacing, traverse: Traverse::OneWay, max_step_mm: 1.0, ..Default::default() };
    // Passes along x on a plane, a rounded and a hollow cylinder with their axis along x.
    let domain = Domain { first: [0.0, 5.0], second: [-20.0, 20.0] };
    for z in ["0", "sqrt(2500 - y^2)", "-sqrt(2500 - y^2)"] {
        let surface = explicit(z, domain);
        let passes = passes(&path::over(&surface, &options).unwrap());
        assert!(passes.len() > 10);
        let mut highest: f64 = 0.0;
        for pair in passes.windows(2) {
            // In the plane across the passes: the two ball centres, and the surface between them.
            let centre = |p: &PathPoint| p.position_mm + p.normal.into_inner() * radius;
            let (a, b) = (pair[0][0], pair[1][0]);
            let (ca, cb) = (centre(&a), centre(&b));
            // The cusp is where both balls meet, on the surface's side.
            let (middle, apart) = (nalgebra::center(&ca, &cb), cb - ca);
            let down = Vector3::new(0.0, apart.z, -apart.y).normalize();
            let down = if down.dot(&a.normal) < 0.0 { down } else { -down };
            let cusp = middle + down * (radius * radius - 0.25 * apart.norm_squared()).sqrt();
            highest = highest.max(surface.deviation_mm(&cusp).unwrap());
        }
        assert!(highest <= 1.01 * scallop_mm && highest > 0.7 * scallop_mm, "{z}: {highest}");
    }
}

#[test]
fn every_pass_is_approached_and_left_along_the_normal() {
    for surface in [wave(), ball()] {
        for options in every_option() {
            let points = path::over(&surface, &options).unwrap();
            let height = options.approach_mm;
            for (i, point) in points.iter().enumerate() {
                let lifted = |cut: &PathPoint| cut.position_mm + cut.normal.into_inner() * height;
                match point.kind {
                    PointKind::Approach => {
                        let cut = &points[i + 1];
                        assert_eq!((cut.kind, cut.pass), (PointKind::Cut, point.pass));
                        assert!((point.position_mm - lifted(cut)).norm() < 1e-12);
                        assert!(point.orientation.angle_to(&cut.orientation) < 1e-7);
                        assert!(i == 0 || matches!(points[i - 1].kind, PointKind::Retract | PointKind::Link));
                    }
                    PointKind::Retract => {
                        let cut = &points[i - 1];
                        assert_eq!((cut.kind, cut.pass), (PointKind::Cut, point.pass));
                        assert!((point.position_mm - lifted(cut)).norm() < 1e-12);
                    }
                    PointKind::Link => assert!(points[i + 1].pass == point.pass && i > 0),
                    PointKind::Cut => assert!(surface.deviation_mm(&point.position_mm).unwrap().abs() < 1e-9),
                }
            }
            assert_eq!(points[0].kind, PointKind::Approach);
            assert_eq!(points[points.len() - 1].kind, PointKind::Retract);
        }
    }
}

#[test]
fn links_stay_clear_of_a_dome() {
    // One-way passes over a ridge: the straight way back from end to start would go through it.
    let ridge = explicit("40*exp(-x^2/200)", Domain { first: [-60.0, 60.0], second: [0.0, 20.0] });
    let options = PathOptions { traverse: Traverse::OneWay, approach_mm: 10.0, ..Default::default() };
    let points = path::over(&ridge, &options).unwrap();
    assert!(points.iter().any(|p| p.kind == PointKind::Link));
    for pair in points.windows(2).filter(|w| w[0].kind != PointKind::Cut && w[1].kind != PointKind::Cut) {
        for i in 0..=100 {
            let at = pair[0].position_mm + (pair[1].position_mm - pair[0].position_mm) * (i as f64 / 100.0);
            let clear = ridge.deviation_mm(&at).unwrap();
            assert!(clear > 3.0, "{clear} at {at}");
        }
    }
    // To and fro over the same ridge, no pass ends far from where the next begins.
    let zigzag = path::over(&ridge, &PathOptions { traverse: Traverse::Zigzag, ..options }).unwrap();
    assert!(zigzag.iter().all(|p| p.kind != PointKind::Link));
}

#[test]
fn zigzag_and_one_way_keep_their_promise() {
    let feeds = |traverse| -> Vec<f64> {
        let points = path::over(&wave(), &PathOptions { traverse, ..Default::default() }).unwrap();
        passes(&points).iter().map(|pass| pass[0].feed.x.signum()).collect()
    };
    assert!(feeds(Traverse::OneWay).iter().all(|s| *s == 1.0));
    assert!(
        feeds(Traverse::Zigzag).iter().enumerate().all(|(i, s)| *s == if i % 2 == 0 { 1.0 } else { -1.0 })
    );
}

#[test]
fn the_tool_never_jumps_with_a_fixed_x() {
    for surface in [wave(), ball()] {
        for pattern in [Pattern::Raster, Pattern::Spiral, Pattern::Contour] {
            let options = PathOptions { pattern, max_step_mm: 3.0, ..Default::default() };
            let points = path::over(&surface, &options).unwrap();
            for pair in points.windows(2) {
                let (a, b) = (pair[0].orientation, pair[1].orientation);
                assert!(a.angle_to(&b) < 0.25, "{pattern:?}: {}", a.angle_to(&b));
                assert!(a.coords.dot(&b.coords) > 0.9);
            }
        }
    }
    // With lead and tilt, a contour turns the tool through its corners in steps, not at once.
    let (lead_rad, tilt_rad) = (0.2, 0.1);
    let options =
        PathOptions { pattern: Pattern::Contour, lead_rad, tilt_rad, max_step_mm: 3.0, ..Default::default() };
    let points = path::over(&explicit("0*x", square(40.0)), &options).unwrap();
    for pass in passes(&points).iter().filter(|pass| pass.len() > 24) {
        for pair in pass.windows(2) {
            assert!(pair[0].orientation.angle_to(&pair[1].orientation) < 0.15);
        }
    }
}

#[test]
fn closed_passes_close_and_the_spiral_is_one_pass() {
    let contour =
        path::over(&wave(), &PathOptions { pattern: Pattern::Contour, ..Default::default() }).unwrap();
    let rings = passes(&contour);
    assert!(rings.len() >= 6);
    for ring in &rings {
        assert!((ring[0].position_mm - ring[ring.len() - 1].position_mm).norm() < 1e-9);
    }
    // From the border inwards, with a point in each corner of the domain.
    for corner in [[-40.0, -30.0], [40.0, -30.0], [40.0, 30.0], [-40.0, 30.0]] {
        assert!(
            rings[0].iter().any(|p| (p.position_mm.x - corner[0]).hypot(p.position_mm.y - corner[1]) < 1e-9)
        );
    }
    let spiral =
        path::over(&wave(), &PathOptions { pattern: Pattern::Spiral, ..Default::default() }).unwrap();
    assert!(spiral.iter().all(|p| p.pass == 0));
    let cuts = &passes(&spiral)[0];
    assert!(cuts[0].position_mm.coords.xy().norm() < 1e-9);
    assert!((cuts[cuts.len() - 1].position_mm.x - 40.0).abs() < 1e-9);
}

#[test]
fn a_pass_is_taken_up_again_beyond_a_hole() {
    let file = sample::PLATE.read().unwrap();
    let points = file.points().unwrap();
    let passes = passes(&points);
    let columns = passes.iter().map(|p| (p[0].position_mm.x * 1e3).round() as i64);
    let distinct: std::collections::BTreeSet<i64> = columns.clone().collect();
    assert!(passes.len() > distinct.len(), "{} passes in {} columns", passes.len(), distinct.len());
    for pair in points.windows(2).filter(|w| w[0].kind == PointKind::Cut && w[1].kind == PointKind::Cut) {
        assert!((pair[1].position_mm - pair[0].position_mm).norm() <= file.path.max_step_mm + 1e-9);
    }
    // A ball alone in a larger domain: every pass of the raster is cut to the ball.
    let ball = implicit("x^2 + y^2 + z^2 - 400", square(30.0), [0.0, 30.0]);
    for cut in path::over(&ball, &PathOptions::default()).unwrap().iter().filter(|p| p.kind == PointKind::Cut)
    {
        assert!((cut.position_mm.coords.norm() - 20.0).abs() < 1e-9);
    }
}

#[test]
fn what_gives_no_path_is_refused() {
    let surface = wave();
    let default = PathOptions::default();
    let step = |step_over_mm| Spacing::StepOver { step_over_mm };
    let scallop = |scallop_mm, tool_radius_mm| Spacing::Scallop { scallop_mm, tool_radius_mm };
    let cases = [
        (PathOptions { spacing: step(0.0), ..default }, "step_over_mm is 0"),
        (PathOptions { spacing: step(f64::NAN), ..default }, "step_over_mm is NaN"),
        (PathOptions { spacing: scallop(-0.1, 5.0), ..default }, "scallop_mm is -0.1"),
        (PathOptions { spacing: scallop(6.0, 5.0), ..default }, "below the tool's radius"),
        (PathOptions { spacing: scallop(0.1, 0.0), ..default }, "tool_radius_mm is 0"),
        (PathOptions { spacing: scallop(0.1, 5000.0), ..default }, "take a smaller tool"),
        (PathOptions { max_step_mm: -1.0, ..default }, "max_step_mm is -1"),
        (PathOptions { chord_mm: 0.0, ..default }, "chord_mm is 0"),
        (PathOptions { lead_rad: 1.5, ..default }, "lead_deg is 85.9"),
        (PathOptions { tilt_rad: f64::NAN, ..default }, "tilt_deg is NaN"),
        (PathOptions { approach_mm: -5.0, ..default }, "approach_mm is -5"),
        (PathOptions { tool_x: ToolX::Fixed(Vector3::zeros()), ..default }, "tool_x_direction"),
        (
            PathOptions { tool_x: ToolX::Fixed(Vector3::z()), spacing: step(60.0), ..default },
            "along the tool",
        ),
        (PathOptions { spacing: step(1e-9), ..default }, "more than 200000 points"),
        (PathOptions { max_step_mm: 1e-4, ..default }, "more than 200000 points"),
        (PathOptions { spacing: step(0.05), max_step_mm: 0.1, ..default }, "more than 200000 points"),
    ];
    for (options, part) in cases {
        // A flat surface has the tool's axis exactly along z.
        let flat = explicit("0", square(20.0));
        let surface =
            if matches!(options.tool_x, ToolX::Fixed(d) if d == Vector3::z()) { &flat } else { &surface };
        let message = path::over(surface, &options).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
    assert!(matches!(
        path::over(&surface, &PathOptions { spacing: scallop(0.1, 5000.0), ..default }),
        Err(SurfaceError::Hollow { tool_mm: 5000.0, .. })
    ));
}

/// What would take hours ends by a count of work, not by a clock: with the chord error of an atom steps have a shortest
/// length, and a wave of a thousand periods is refused by name.
#[test]
fn a_path_that_would_take_hours_ends_or_is_refused_by_name() {
    let fine = PathOptions { chord_mm: 1e-9, ..Default::default() };
    let spiral = PathOptions { pattern: Pattern::Spiral, ..fine };
    let dust = PathOptions { chord_mm: 1e-300, max_step_mm: 1e-3, ..Default::default() };
    for (surface, options) in [(&ball(), &fine), (&ball(), &spiral), (&wave(), &dust)] {
        match path::over(surface, options) {
            Ok(path) => assert!(path.len() < 1_000_000, "{options:?}: {}", path.len()),
            Err(error) => assert!(
                matches!(error, SurfaceError::TooMuchWork { .. } | SurfaceError::TooLong { .. }),
                "{options:?}: {error}"
            ),
        }
    }
    let waves = implicit("z - sin(1000*x)*cos(1000*y)", square(45.0), [-20.0, 20.0]);
    let found = path::over(&waves, &PathOptions::default());
    assert!(
        matches!(found, Err(SurfaceError::TooMuchWork { .. } | SurfaceError::TooLong { .. })),
        "{:?}",
        found.map(|p| p.len())
    );
}

#[test]
fn triangles_all_over_each_other_are_refused_by_name() {
    use rand::{RngExt, SeedableRng};
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    let vertices: Vec<Point3<f64>> = (0..9_000)
        .map(|_| Point3::new(0.0, 0.0, 0.0).map(|_: f64| random.random_range(-60.0..60.0)))
        .collect();
    let facets = (0..3_000).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let noise = truegrind_surfaces::Mesh::new(vertices, facets, &Default::default()).unwrap();
    let found = path::over(&Surface::Mesh(noise), &PathOptions { max_step_mm: 0.05, ..Default::default() });
    assert!(
        matches!(found, Err(SurfaceError::TooMuchWork { .. } | SurfaceError::TooLong { .. })),
        "{:?}",
        found.map(|p| p.len())
    );
}
