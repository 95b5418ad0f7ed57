use nalgebra::{Point3, Vector3};
use truegrind_surfaces::path::{Along, Pattern, Spacing, ToolX};
use truegrind_surfaces::{Origin, PointKind, Surface, SurfaceError, SurfaceFile, sample};

fn read(text: &str) -> Result<SurfaceFile, SurfaceError> {
    SurfaceFile::read("job.toml", text.as_bytes(), |name| Err::<Vec<u8>, _>(format!("no file {name}")))
}

/// The blade with one line replaced (or added in front of it, where the replacement holds both).
fn blade(line: &str, replacement: &str) -> String {
    let text = std::str::from_utf8(sample::BLADE.bytes).unwrap();
    assert!(text.matches(&format!("\n{line}\n")).count() == 1, "{line}");
    text.replace(&format!("\n{line}\n"), &format!("\n{replacement}\n"))
}

const Z: &str = "z = \"-x^2/600 - y^2/1200 + x*y/4000 + 1.5*sin(y/40)\"";
const POSITION: &str = "position_mm = [420, 0, 250]";

#[test]
fn the_samples_read_and_make_paths_of_a_sensible_length() {
    for (sample, pattern) in [
        (sample::BLADE, Pattern::Raster),
        (sample::DOME, Pattern::Spiral),
        (sample::SADDLE, Pattern::Contour),
        (sample::PLATE, Pattern::Raster),
    ] {
        let file = sample.read().unwrap();
        assert_eq!(file.path.pattern, pattern);
        let points = file.points().unwrap();
        let cuts = points.iter().filter(|p| p.kind == PointKind::Cut).count();
        assert!((200..=900).contains(&cuts), "{}: {cuts} cuts of {} points", sample.file, points.len());
        assert!(points.iter().all(|p| p.position_mm.iter().all(|c| c.is_finite())));
    }
    assert_eq!(sample::ALL.len(), 4);
}

#[test]
fn the_blade_lies_in_front_of_a_small_arm_and_the_tool_points_down() {
    let file = sample::BLADE.read().unwrap();
    assert_eq!(
        (file.name.as_str(), file.work_object.name.as_str(), file.tool.name.as_str()),
        ("blade", "wobjBlade", "tSpindle")
    );
    assert_eq!(
        (file.work_object.origin, file.tool.origin),
        (Some(Origin::Metrology), Some(Origin::Metrology))
    );
    assert_eq!((file.speed_mm_s, file.travel_speed_mm_s, file.zone.as_str()), (40.0, 150.0, "z1"));
    assert_eq!((file.tool.mass_kg, file.tool.radius_mm), (1.2, Some(20.0)));
    assert_eq!(file.tool.flange_from_tool.translation.vector, Vector3::new(0.0, 0.0, 120.0));
    let points = file.points().unwrap();
    let cuts: Vec<_> = points.iter().filter(|p| p.kind == PointKind::Cut).collect();
    assert!((300..=500).contains(&cuts.len()), "{}", cuts.len());
    for cut in cuts {
        let base_from_tool = file.work_object.base_from_work_object * cut.work_object_from_tool();
        let place = base_from_tool * Point3::origin();
        assert!((place - Point3::new(420.0, 0.0, 250.0)).norm() < 110.0);
        // The wrist centre of an IRB 120 (flange 72 mm beyond it, upper and lower arm 270 and 310 mm from the
        // shoulder at z = 290).
        let wrist = base_from_tool * Point3::new(0.0, 0.0, -192.0);
        let reach = (wrist - Point3::new(0.0, 0.0, 290.0)).norm();
        assert!(reach < 0.97 * 580.0, "{reach}");
        assert!((base_from_tool * Vector3::z()).z < -0.95);
    }
}

#[test]
fn every_key_arrives() {
    let text = r#"
        [surface]
        kind = "parametric"
        x = "u"
        y = "v"
        z = "0"
        u = [0, 40]
        v = [0, 30]
        flip_normal = true
        [work_object]
        name = "wobj1"
        position_mm = [400, 10, 20]
        rpy_deg = [10, 20, 30]
        [tool]
        name = "t1"
        position_mm = [1, 2, 100]
        quaternion = [0.7071, 0, 0.7071, 0]
        mass_kg = 2
        cog_mm = [1, 2, 50]
        radius_mm = 9
        origin = "taught"
        [path]
        pattern = "raster"
        along = "v"
        traverse = "one-way"
        scallop_mm = 0.02
        max_step_mm = 3
        chord_mm = 0.01
        lead_deg = 10
        tilt_deg = -5
        tool_x = "feed"
        approach_mm = 7
        speed_mm_s = 25
        zone = "fine"
    "#;
    let file = read(text).unwrap();
    assert_eq!(file.name, "surface");
    assert!(matches!(&file.surface, Surface::Parametric(_)));
    assert!(file.surface.contact([1.0, 1.0]).unwrap().normal.z < -0.999);
    // Roll about x, then pitch about y, then yaw about z, each in the fixed frame.
    let turn = |axis, degrees: f64| nalgebra::UnitQuaternion::from_axis_angle(&axis, degrees.to_radians());
    let expected =
        turn(Vector3::z_axis(), 30.0) * turn(Vector3::y_axis(), 20.0) * turn(Vector3::x_axis(), 10.0);
    assert!(file.work_object.base_from_work_object.rotation.angle_to(&expected) < 1e-7);
    assert_eq!(file.work_object.origin, None);
    assert!((file.tool.flange_from_tool.rotation.norm() - 1.0).abs() < 1e-15);
    assert!((file.tool.flange_from_tool.rotation * Vector3::z() - Vector3::x()).norm() < 1e-9);
    assert_eq!((file.tool.cog_mm, file.tool.origin), (Vector3::new(1.0, 2.0, 50.0), Some(Origin::Taught)));
    assert_eq!(file.path.along, Along::Second);
    assert_eq!(file.path.spacing, Spacing::Scallop { scallop_mm: 0.02, tool_radius_mm: 9.0 });
    assert_eq!((file.path.max_step_mm, file.path.chord_mm, file.path.approach_mm), (3.0, 0.01, 7.0));
    assert_eq!((file.path.lead_rad, file.path.tilt_rad), (10_f64.to_radians(), -5_f64.to_radians()));
    assert_eq!(file.path.tool_x, ToolX::Feed);
    assert_eq!((file.speed_mm_s, file.travel_speed_mm_s, file.zone.as_str()), (25.0, 100.0, "fine"));
}

#[test]
fn what_is_wrong_is_named_with_file_and_key() {
    // What replaces a line of the blade, and what the message must name.
    let cases: Vec<(String, &[&str])> = vec![
        (blade(Z, "z = \"12 - x^^2\""), &["`surface.z`", "column 8", "found `^`"]),
        (blade(Z, "z = \"x + w\""), &["`surface.z`", "unknown name `w`", "variables x, y"]),
        (blade(Z, "z = \"ln(x)\""), &["`surface`", "not finite", "x = -50", "shrink the domain"]),
        (blade(Z, "z = 3"), &["line 8", "column 5", "expected a string"]),
        (blade(Z, ""), &["line 5", "missing field `z`"]),
        (blade(Z, &format!("{Z}\nu = [0, 1]")), &["line 9", "unknown field `u`", "`x_mm`"]),
        (blade(Z, &format!("{Z}\ncolour = 3")), &["line 9", "column 1", "unknown field `colour`"]),
        (
            blade("kind = \"explicit\"", "kind = \"exotic\""),
            &["line 6", "unknown variant `exotic`", "`explicit`"],
        ),
        (blade("kind = \"explicit\"", "kind = \"mesh\""), &["line 8", "unknown field `z`", "`mesh`"]),
        (
            blade("x_mm = [-50, 50]", "x_mm = [50, -50]"),
            &["`surface.x_mm`", "50 to -50", "the smaller first"],
        ),
        (blade("x_mm = [-50, 50]", "x_mm = [-50, nan]"), &["`surface.x_mm`", "NaN"]),
        (blade("x_mm = [-50, 50]", "x_mm = [-50]"), &["line 9", "expected an array of length 2"]),
        (blade("x_mm = [-50, 50]", "x_mm = [-50, 50"), &["line 10"]),
        (blade("name = \"blade\"", "name = \"my blade\""), &["`name`", "`my blade`", "letters, digits or _"]),
        (blade("name = \"wobjBlade\"", "name = \"1wobj\""), &["`work_object.name`", "`1wobj`"]),
        (blade("name = \"wobjBlade\"", ""), &["line", "missing field `name`"]),
        (blade(POSITION, "position_mm = [0.42, 0, 0.25]"), &["`work_object.position_mm`", "metres", "1000"]),
        (blade(POSITION, "position_mm = [inf, 0, 0]"), &["`work_object.position_mm`", "inf"]),
        (blade("position_mm = [0, 0, 120]", "position_mm = [0, 0, 0.12]"), &["`tool.position_mm`", "metres"]),
        (
            blade("rpy_deg = [0, 0, 0]", "quaternion = [1, 1, 0, 0]"),
            &["`work_object.quaternion`", "length 1.41"],
        ),
        (
            blade("rpy_deg = [0, 0, 0]", "quaternion = [0, 0, 0, 0]"),
            &["`work_object.quaternion`", "length 0"],
        ),
        (blade("rpy_deg = [0, 0, 0]", "rpy_deg = [0, 0, nan]"), &["`work_object.rpy_deg`", "NaN"]),
        (
            blade("quaternion = [1, 0, 0, 0]", "quaternion = [1, 0, 0, 0]\nrpy_deg = [0, 0, 0]"),
            &["`tool.rpy_deg`", "either"],
        ),
        (blade("mass_kg = 1.2", "mass_kg = 0"), &["`tool.mass_kg`", "found 0", "above 0"]),
        (blade("cog_mm = [0, 0, 55]", "cog_mm = [0, 0, nan]"), &["`tool.cog_mm`", "finite"]),
        (blade("radius_mm = 20", "radius_mm = -20"), &["`tool.radius_mm`", "found -20"]),
        (blade("pattern = \"raster\"", "pattern = \"zebra\""), &["unknown variant `zebra`", "`spiral`"]),
        (blade("pattern = \"raster\"", "pattern = \"spiral\""), &["`path.along`", "raster"]),
        (blade("along = \"y\"", "along = \"v\""), &["`path.along`", "`v`", "`x` or `y`"]),
        (
            blade("step_over_mm = 8", ""),
            &["`path.step_over_mm`", "found nothing", "either step_over_mm or scallop_mm"],
        ),
        (
            blade("step_over_mm = 8", "step_over_mm = 8\nscallop_mm = 0.1"),
            &["`path.step_over_mm`", "scallop_mm beside it"],
        ),
        (blade("step_over_mm = 8", "step_over_mm = 0"), &["`path.step_over_mm`", "found 0", "above 0"]),
        (blade("step_over_mm = 8", "scallop_mm = 30"), &["`path.scallop_mm`", "below the tool's radius"]),
        (
            blade("radius_mm = 20", "").replace("step_over_mm = 8", "scallop_mm = 0.1"),
            &["`tool.radius_mm`", "scallop_mm is given"],
        ),
        (blade("max_step_mm = 6", "max_step_mm = -6"), &["`path.max_step_mm`", "found -6"]),
        (blade("max_step_mm = 6", "max_step_mm = \"6\""), &["line 31", "expected f64"]),
        (blade("max_step_mm = 6", "lead_deg = 95"), &["`path.lead_deg`", "found 95", "-80 to 80"]),
        (blade("chord_mm = 0.02", "chord_mm = 0"), &["`path.chord_mm`"]),
        (blade("tool_x = \"fixed\"", "tool_x = \"feed\""), &["`path.tool_x_direction`", "feed"]),
        (
            blade("tool_x_direction = [-1, 0, 0]", "tool_x_direction = [0, 0, 0]"),
            &["`path.tool_x_direction`"],
        ),
        (blade("approach_mm = 20", "approach_mm = -1"), &["`path.approach_mm`"]),
        (blade("speed_mm_s = 40", "speed_mm_s = 0"), &["`path.speed_mm_s`", "above 0"]),
        (blade("speed_mm_s = 40", ""), &["missing field `speed_mm_s`"]),
        (blade("zone = \"z1\"", "zone = \"z2\""), &["`path.zone`", "`z2`", "fine, z0, z1"]),
        (String::new(), &["line 1", "missing field `surface`"]),
        ("name = ".to_owned(), &["line 1"]),
    ];
    for (text, parts) in cases {
        let message = read(&text).unwrap_err().to_string();
        assert!(message.starts_with("job.toml"), "{message}");
        for part in parts {
            assert!(message.contains(part), "{part} is not in: {message}");
        }
        assert!(!message.contains('\n'), "{message}");
    }
}

#[test]
fn bytes_that_are_no_text_are_refused_with_their_place() {
    let error = SurfaceFile::read("job.toml", b"name = \"a\"\n# caf\xe9\n", |_| Err::<Vec<u8>, _>("none"))
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "job.toml, line 2, column 6: found a byte that is not UTF-8, expected text"
    );
}

#[test]
fn a_mesh_is_asked_for_by_its_name_and_what_is_wrong_with_it_names_the_key() {
    let plate = std::str::from_utf8(sample::PLATE.bytes).unwrap();
    let with = |text: &str, mesh: Result<Vec<u8>, &str>| {
        SurfaceFile::read("plate.toml", text.as_bytes(), |name| {
            assert_eq!(name, "plate.stl");
            mesh.map_err(str::to_owned)
        })
    };
    let stl = || Ok(sample::PLATE_STL.to_vec());
    assert!(matches!(with(plate, stl()).unwrap().surface, Surface::Mesh(_)));
    let neither = plate.replace("x_mm = [-48, 48]\ny_mm = [-68, 68]\n", "");
    let whole = with(&neither, stl()).unwrap().surface.domain();
    assert!((whole.first[1] - 50.0).abs() < 1e-6 && (whole.second[0] + 70.0).abs() < 1e-6);
    let cases = [
        (
            with(plate, Err("no such file")),
            "`surface.mesh`: found `plate.stl`, which cannot be read (no such file)",
        ),
        (with(plate, Ok(b"solid".to_vec())), "`surface.mesh`: the mesh cannot be read as STL"),
        (with(&plate.replace("y_mm = [-68, 68]\n", ""), stl()), "`surface.y_mm`: found nothing"),
        (with(&plate.replace("[-48, 48]", "[48, -48]"), stl()), "`surface.x_mm`: the range of x"),
        (
            with(&plate.replace("x_mm = [-48", "unit_mm = 0\nx_mm = [-48"), stl()),
            "`surface.unit_mm`: found 0",
        ),
        (
            with(&plate.replace("x_mm = [-48", "flip_normal = true\nx_mm = [-48"), stl()),
            "only the back of its triangles",
        ),
        (with(&neither.replace("[work_object]", "unit_mm = 0.01\n[work_object]"), stl()), "unit_mm = 1000"),
    ];
    for (made, part) in cases {
        let message = made.unwrap_err().to_string();
        assert!(message.starts_with("plate.toml, key ") && message.contains(part), "{message}");
    }
}

#[test]
fn damaged_samples_never_panic() {
    // Every sample cut short at every fifth line, and with each number made absurd.
    for sample in sample::ALL {
        let text = std::str::from_utf8(sample.bytes).unwrap();
        let resolve = |_: &str| Ok::<_, String>(sample::PLATE_STL[..2000].to_vec());
        for (at, _) in text.match_indices('\n').step_by(5) {
            assert!(
                SurfaceFile::read(sample.file, &text.as_bytes()[..at], resolve).is_err()
                    || at + 40 > text.len()
            );
        }
        for absurd in ["1e308", "nan", "0"] {
            for (at, _) in text.match_indices(" = [") {
                let line = at + text[at..].find('\n').unwrap();
                let list = text[at..line].replace(|c: char| c.is_ascii_digit(), "0").matches(',').count() + 1;
                let numbers = vec![absurd; list].join(", ");
                let changed = format!("{} = [{numbers}]{}", &text[..at], &text[line..]);
                let read = SurfaceFile::read(sample.file, changed.as_bytes(), resolve);
                // A frame does not reach the path, which takes longer than all the rest.
                let frame = ["position_mm", "quaternion", "rpy_deg", "cog_mm"];
                if let Ok(file) = read
                    && !frame.iter().any(|key| text[..at].ends_with(key))
                {
                    let _ = file.points();
                }
            }
        }
    }
}

/// The class: a surface file of a few lines that asks for hours or for all memory. Each number of each file that ships is
/// put wrong in turn; the file or its path is refused, or the path is finite.
#[test]
fn a_file_with_any_number_wrong_is_refused_or_gives_a_finite_path() {
    use rayon::prelude::*;
    use truegrind_surfaces::{SurfaceFile, sample};
    for shipped in [&sample::BLADE, &sample::DOME, &sample::SADDLE] {
        let text = std::str::from_utf8(shipped.bytes).unwrap();
        truegrind_testing::absurd::each(text).par_bridge().for_each(|(said, text)| {
            let none = |_: &str| Err::<Vec<u8>, _>("no mesh");
            let Ok(file) = SurfaceFile::read("s.toml", text.as_bytes(), none) else { return };
            assert!(!said.contains("nan") && !said.contains("inf"), "{said}");
            let Ok(points) = file.points() else { return };
            for point in points {
                assert!(point.position_mm.iter().all(|v| v.is_finite()), "{said}");
                assert!(point.orientation.coords.iter().all(|v| v.is_finite()), "{said}");
            }
        });
    }
}
