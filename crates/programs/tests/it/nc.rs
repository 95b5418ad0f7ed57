//! NC programs: lossless reading, interpretation of the modal state, rewriting.

use std::path::Path;

use proptest::prelude::*;
use truegrind_programs::motion::{
    Frame, Listing, Mark, MotionKind, Origin, Reason, RobTarget, Role, TargetValue,
};
use truegrind_programs::nc::dialect::Dialect;
use truegrind_programs::nc::orientation::{Angles, spun, vector_and_spin};
use truegrind_programs::nc::parser::parse;
use truegrind_programs::nc::setup::Setup;
use truegrind_programs::nc::{Task, mark};
use truegrind_programs::rewrite::{Change, Extra, NewTarget, RewriteOptions, RewriteOutcome, Rewritten};

use super::samples::{root, told};

mod arcs;
mod default_deny;
mod blocks;
mod frames;
mod heidenhain;
mod line_length;
mod paths;
mod position_dependencies;
mod m_words;
mod unmodified;
mod remainder;
mod subprograms;

const DIALECTS: [Dialect; 5] =
    [Dialect::Iso, Dialect::Fanuc, Dialect::LinuxCnc, Dialect::Siemens, Dialect::Heidenhain];

/// The NC samples of `programs/`.
pub(crate) fn samples() -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> =
        std::fs::read_dir(root().join("programs")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
        .into_iter()
        .filter(|file| {
            ["nc", "mpf", "ngc", "h"].iter().any(|wanted| file.extension().is_some_and(|e| e == *wanted))
        })
        .map(|file| (file.file_name().unwrap().to_str().unwrap().to_owned(), std::fs::read(&file).unwrap()))
        .collect()
}

pub(crate) fn read<'s>(name: &str, bytes: &'s [u8]) -> Task<'s> {
    Task::read(&[(name, bytes)], &Setup::default())
}

#[test]
fn every_sample_comes_back_and_is_listed_as_expected() {
    let update = std::env::var_os("TRUEGRIND_UPDATE_LISTINGS").is_some();
    let samples = samples();
    assert!(samples.len() >= 6, "{}", samples.len());
    for (name, bytes) in &samples {
        let task = read(name, bytes);
        assert_eq!(task.trees[0].print(), *bytes, "{name}");
        let found = format!("{}\n{}", task.dialects[0].text(), told(&task.listing, &task.names));
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/listings").join(format!("{name}.txt"));
        if update {
            std::fs::write(&path, &found).unwrap();
        }
        let expected = std::fs::read_to_string(&path).unwrap_or_default();
        assert_eq!(
            found, expected,
            "{name}: run with TRUEGRIND_UPDATE_LISTINGS=1 to write {path:?}, then read it"
        );
    }
}

#[test]
fn the_dialect_of_each_sample_is_detected() {
    let found: Vec<(String, Dialect)> =
        samples().iter().map(|(name, bytes)| (name.clone(), Dialect::of(bytes))).collect();
    let expected = [
        ("circles.nc", Dialect::Iso),
        ("fanuc.nc", Dialect::Fanuc),
        ("heidenhain.h", Dialect::Heidenhain),
        ("linuxcnc.ngc", Dialect::LinuxCnc),
        ("plain.nc", Dialect::Iso),
        ("robot.nc", Dialect::Iso),
        ("siemens.mpf", Dialect::Siemens),
    ];
    for (name, dialect) in expected {
        assert!(found.contains(&(name.to_owned(), dialect)), "{name}: {found:?}");
    }
}

fn check(source: &[u8], dialect: Dialect) {
    let tree = parse(source, dialect);
    assert_eq!(tree.print(), source);
    assert_eq!(tree.nodes.subtree_end(0), tree.nodes.len());
    let mut open: Vec<(usize, u32, u32)> = vec![];
    for (index, node) in tree.nodes.iter().enumerate() {
        while open.last().is_some_and(|&(end, ..)| end <= index) {
            open.pop();
        }
        assert!(node.first <= node.end && node.size > 0, "{index} {node:?}");
        if let Some((_, least, most)) = open.last_mut() {
            assert!(node.first >= *least && node.end <= *most, "{index} {node:?} {least} {most}");
            *least = node.end;
        }
        open.push((index + node.size as usize, node.first, node.end));
    }
    // Listing and rewriting terminate on any bytes.
    let setup = Setup { dialect: Some(dialect), angles: Some(Angles::Wpr), ..Setup::default() };
    let task = Task::read(&[("x", source)], &setup);
    let rewritten =
        task.rewrite(&moved(&task.listing, [0.25, -0.5, 0.125]), &RewriteOptions::default()).unwrap();
    rewritten.files[0].edits.apply(source).unwrap();
}

/// Changes that displace every known target.
fn moved(listing: &Listing, by: [f64; 3]) -> Vec<Change> {
    (0_u32..)
        .zip(&listing.motions)
        .filter(|(_, motion)| motion.reason().is_none() && !motion.targets.is_empty())
        .map(|(motion, listed)| {
            let targets = listed.targets.iter().map(|target| match target.value {
                Ok(TargetValue::Cartesian(t)) => NewTarget::Cartesian {
                    position_mm: std::array::from_fn(|i| t.position_mm[i] + by[i]),
                    quaternion: t.quaternion,
                    conf: None,
                },
                _ => NewTarget::Keep,
            });
            Change { motion, targets: targets.collect(), before: vec![] }
        })
        .collect()
}

proptest! {
    #[test]
    fn any_bytes_come_back(bytes in proptest::collection::vec(any::<u8>(), 0..300), dialect in 0_usize..5) {
        check(&bytes, DIALECTS[dialect]);
    }

    #[test]
    fn any_order_of_words_comes_back(words in proptest::collection::vec(0_usize..84, 0..80), dialect in 0_usize..5) {
        let pieces = ["G0", "G1", "G2", "G3", "G91", "G90", "G92", "G53", "G54", "G41", "G40", "G43.4", "G43.5", "G68", "G28",
            "X1.", "Y-2.5", "Z.5", "A180.", "B0", "C-.5", "I5.", "J-5.", "K1", "R10.", "F600", "X#1", "#1=2", "#1=[#2*3]",
            "X[1+2]", "X=IC(5)", "A3=0.1", "B3=0", "C3=1", "THETA=5", "R1=5", "X=R1", "TRAORI", "TRANS", "ROT", "M30", "M98",
            "P5", "\n", "\n", "\n", "/", "N10", "(c)", "; c\n", "%\n", "[", "]", "(", ")", "=", "O5", "GOTO", "L", "L X+1 Y+2",
            "CC X+1 Y+1", "C X+3 Y+1 DR+", "Q1 = +5", "LBL 1",
            "M99", "M97", "M19", "M129", "M205", "M17", "CIP", "CT", "RND=2", "PLANE RESET TURN", "FN 25: PRESET = X/+0/+1", "CP IPA+90 DR+",
            "5 ;c~\n", "LN X+1 TX+0 TY+0 TZ+1", "DEF INT R=1", "G52", "G92.1", "G69", "G80", "$A%\n"];
        let text: String = words.iter().map(|&word| format!("{} ", pieces[word])).collect();
        check(text.as_bytes(), DIALECTS[dialect]);
    }

    #[test]
    fn a_damaged_sample_comes_back(sample in 0_usize..6, at in 0_usize..2000, cut in 0_usize..40, insert in proptest::collection::vec(any::<u8>(), 0..6)) {
        let samples = samples();
        let (_, bytes) = &samples[sample % samples.len()];
        let mut bytes = bytes.clone();
        let at = at % bytes.len();
        let end = (at + cut).min(bytes.len());
        bytes.splice(at..end, insert);
        check(&bytes, Dialect::of(&bytes));
    }

    #[test]
    fn angles_mean_the_same_rotation_and_stay_near(a in -200.0..200.0_f64, b in -200.0..200.0_f64, c in -200.0..200.0_f64, d in -0.5..0.5_f64) {
        for angles in [Angles::Abc, Angles::Wpr, Angles::Rxyz, Angles::RotationVector] {
            let rotation = angles.rotation([a, b, c]);
            let found = angles.angles(&rotation, [a + d, b - d, c + d]);
            prop_assert!(angles.rotation(found).angle_to(&rotation) < 1e-7, "{angles:?} {found:?}");
            if angles != Angles::RotationVector && (b.abs() - 90.0).abs() > 5.0 {
                for (found, wanted) in found.iter().zip([a, b, c]) {
                    prop_assert!((found - wanted).abs() < 1e-6, "{angles:?} {found} {wanted}");
                }
            }
        }
        let rotation = Angles::Wpr.rotation([a, b, c]);
        let (vector, spin) = vector_and_spin(&rotation, c);
        prop_assert!(spun(vector, spin).unwrap().angle_to(&rotation) < 1e-7);
        prop_assert!((spin - c).abs() <= 180.0 + 1e-9);
    }
}

#[test]
fn gimbal_lock_keeps_the_rotation() {
    for angles in [Angles::Abc, Angles::Wpr, Angles::Rxyz] {
        for middle in [90.0, -90.0] {
            let rotation = angles.rotation([30.0, middle, 50.0]);
            let found = angles.angles(&rotation, [31.0, middle, 49.0]);
            assert!(angles.rotation(found).angle_to(&rotation) < 1e-7, "{angles:?} {found:?}");
        }
    }
}

const HEAD: &str = "; truegrind angles wpr\n; truegrind tool T0 t [[0,0,100],[1,0,0,0]]\n; truegrind frame G54 w [[500,0,0],[1,0,0,0]]\n; truegrind frame G500 w [[500,0,0],[1,0,0,0]]\n";

fn listing_of(body: &str, dialect: Dialect) -> Listing {
    let source = format!("{HEAD}{body}");
    let setup = Setup { dialect: Some(dialect), ..Setup::default() };
    let task = Task::read(&[("x", source.as_bytes())], &setup);
    assert!(task.listing.opaque.is_empty(), "{body}: {:?}", task.listing.opaque);
    task.listing
}

fn ends(body: &str, dialect: Dialect) -> Vec<Result<[f64; 3], Reason>> {
    let listing = listing_of(body, dialect);
    let round = |x: f64| (x * 1e6).round() / 1e6;
    listing
        .motions
        .iter()
        .map(|motion| match motion.reason() {
            Some(reason) => Err(reason),
            None => {
                let value = motion.to().unwrap().value.unwrap();
                Ok(value.cartesian().unwrap().position_mm.map(round))
            }
        })
        .collect()
}

#[test]
fn modal_words_increments_units_and_shifts_are_interpreted() {
    let all = "G1 X1 Y2 Z3 A0 B0 C0\n";
    let cases: &[(&str, &[[f64; 3]])] = &[
        ("X5\nZ-1", &[[1.0, 2.0, 3.0], [5.0, 2.0, 3.0], [5.0, 2.0, -1.0]]),
        ("G91 X5\nZ-1", &[[1.0, 2.0, 3.0], [6.0, 2.0, 3.0], [6.0, 2.0, 2.0]]),
        ("G20 X1\nG21 Y.5", &[[1.0, 2.0, 3.0], [25.4, 2.0, 3.0], [25.4, 0.5, 3.0]]),
        ("G92 X0 Z0\nX5 Z1", &[[1.0, 2.0, 3.0], [6.0, 2.0, 4.0]]),
        ("G92 X0\nX5\nG92.1\nX5", &[[1.0, 2.0, 3.0], [6.0, 2.0, 3.0], [5.0, 2.0, 3.0]]),
        ("G52 X10\nX5\nG52 X0\nX5", &[[1.0, 2.0, 3.0], [15.0, 2.0, 3.0], [5.0, 2.0, 3.0]]),
        ("#1=2\n#2=[#1*3+SIN[30]]\nX#2 Y-#1 Z[#1-1]", &[[1.0, 2.0, 3.0], [6.5, -2.0, 1.0]]),
        ("N5 x 1 . 5", &[[1.0, 2.0, 3.0]]),
    ];
    for (body, expected) in &cases[..cases.len() - 1] {
        let found = ends(&format!("{all}{body}\n"), Dialect::LinuxCnc);
        assert_eq!(found, expected.iter().map(|p| Ok(*p)).collect::<Vec<_>>(), "{body}");
    }
    let siemens = ends(
        "TRAORI\nG1 X1 Y2 Z3 A0 B0 C0\nX=IC(4) R1=5\nY=AC(7) G91\nX1 Z=AC(R1)\nG90 X=R1*2-1",
        Dialect::Siemens,
    );
    let expected = [[1.0, 2.0, 3.0], [5.0, 2.0, 3.0], [5.0, 7.0, 3.0], [6.0, 7.0, 5.0], [9.0, 7.0, 5.0]];
    assert_eq!(siemens, expected.map(Ok));
}

#[test]
fn a_block_that_begins_with_its_centre_can_become_straight() {
    use truegrind_programs::motion::MotionKind;
    use truegrind_programs::rewrite::{Change, NewTarget, RewriteOptions};
    let source = format!("{HEAD}G1 X0 Y0 Z0 A0 B0 C0 F100\nG2 X20 Y0 I10 J0\n I10 J0 X40\n");
    let setup = Setup { dialect: Some(Dialect::LinuxCnc), ..Setup::default() };
    let task = Task::read(&[("x", source.as_bytes())], &setup);
    let motion = &task.listing.motions[2];
    assert!(motion.can_straighten && motion.reason().is_none(), "{motion:?}");
    let end = *motion.to().unwrap().value.unwrap().cartesian().unwrap();
    let new = NewTarget::Cartesian { position_mm: [40.0, 0.5, 0.0], quaternion: end.quaternion, conf: None };
    let targets = motion.targets.iter().map(|t| if t.role == Role::Via { NewTarget::Drop } else { new });
    let change = Change { motion: 2, targets: targets.collect(), before: Vec::new() };
    let rewritten = task.rewrite(&[change], &RewriteOptions::default()).unwrap();
    let text = rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
    let again = Task::read(&[("x", &text)], &setup);
    let motion = &again.listing.motions[2];
    assert_eq!(motion.kind, MotionKind::Linear, "{}", String::from_utf8_lossy(&text));
    assert_eq!(motion.to().unwrap().value.unwrap().cartesian().unwrap().position_mm, [40.0, 0.5, 0.0]);
}

#[test]
fn heidenhain_presets_and_datum_shifts_are_interpreted() {
    let go = "L X+1 Y+2 Z+3 A+0 B+0 C+0\n";
    let in_base = |body: &str| -> Vec<Result<[f64; 3], Reason>> {
        let preset = "; truegrind frame PRESET1 w [[600,0,0],[1,0,0,0]]\n";
        let listing = listing_of(&format!("{preset}M128 F1000\n{body}"), Dialect::Heidenhain);
        let stands = |motion: &truegrind_programs::motion::Motion| {
            if let Some(reason) = motion.reason() {
                return Err(reason);
            }
            let object = listing.work_object(motion).unwrap().value.clone().unwrap();
            let told = motion.to().unwrap().value.unwrap().cartesian().unwrap().pose();
            let pose = object.user_frame.pose() * object.object_frame.pose() * told;
            Ok(pose.translation.vector.map(|x| (x * 1e6).round() / 1e6).into())
        };
        listing.motions.iter().map(stands).collect()
    };
    let shift = "CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 X+10\nCYCL DEF 7.2 Y-5,5\n";
    assert_eq!(
        in_base(&format!("{go}{shift}{go}CYCL DEF 7.1 IX+5\n{go}CYCL DEF 7.1 X+0\nCYCL DEF 7.2 Y+0\n{go}")),
        [[501.0, 2.0, 3.0], [511.0, -3.5, 3.0], [516.0, -3.5, 3.0], [501.0, 2.0, 3.0]].map(Ok)
    );
    assert_eq!(
        in_base(&format!("TRANS DATUM AXIS Z+7\n{go}TRANS DATUM RESET\n{go}")),
        [[501.0, 2.0, 10.0], [501.0, 2.0, 3.0]].map(Ok)
    );
    assert_eq!(
        in_base(&format!("CYCL DEF 247 DATUM SETTING ~\n  Q339=+1 ;NUMBER\n{go}{shift}{go}")),
        [[601.0, 2.0, 3.0], [611.0, -3.5, 3.0]].map(Ok)
    );
    // A preset with an unknown frame, a row of a table, a rotation.
    let left = |body: &str| in_base(&format!("{body}\n{go}"))[0];
    assert_eq!(left("CYCL DEF 247 DATUM SETTING Q339=+4"), Err(Reason::WorkObjectUnknown));
    assert_eq!(left("CYCL DEF 7.0 DATUM SHIFT\nCYCL DEF 7.1 #5"), Err(Reason::Transformed));
    assert_eq!(left("CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+30"), Err(Reason::Transformed));
}

fn via(listing: &Listing, motion: usize) -> [f64; 3] {
    let target = listing.motions[motion].targets.iter().find(|target| target.role == Role::Via).unwrap();
    target.value.unwrap().cartesian().unwrap().position_mm
}

#[test]
fn arcs_by_centre_and_by_radius_in_three_planes() {
    let half = 10.0 * std::f64::consts::FRAC_1_SQRT_2;
    let cases: &[(&str, [f64; 3])] = &[
        ("G17 G3 X0 Y10 I-10 J0", [half, half, 0.0]),
        ("G17 G2 X0 Y10 I-10 J0", [-half, -half, 0.0]),
        ("G17 G3 X0 Y10 R10", [half, half, 0.0]),
        ("G17 G3 X0 Y10 R-10", [10.0 + half, 10.0 + half, 0.0]),
        ("G17 G2 X0 Y10 R10", [10.0 - half, 10.0 - half, 0.0]),
        ("G17 G3 X-10 Y0 Z4 I-10 J0", [0.0, 10.0, 2.0]),
        ("G17 G3 I-10", [-10.0, 0.0, 0.0]),
        ("G17 G90.1 G3 X0 Y10 I0 J0", [half, half, 0.0]),
        ("G18 G3 X0 Z-10 I-10 K0", [half, 0.0, -half]),
        ("G18 G2 X0 Z10 I-10 K0", [half, 0.0, half]),
    ];
    for (body, expected) in cases {
        let listing = listing_of(&format!("G1 X10 Y0 Z0 A0 B0 C0\n{body}\n"), Dialect::LinuxCnc);
        assert_eq!(listing.motions[1].kind, MotionKind::Circular);
        let found = via(&listing, 1);
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{body}: {found} {expected}");
        }
    }
    let listing = listing_of("G1 X0 Y10 Z0 A0 B0 C0\nG19 G3 Y0 Z10 J-10 K0\n", Dialect::LinuxCnc);
    assert!((via(&listing, 1)[1] - half).abs() < 1e-9);
}

#[test]
fn orientations_by_angles_and_by_vector() {
    let of = |body: &str, dialect: Dialect| -> RobTarget {
        let listing = listing_of(body, dialect);
        *listing.motions.last().unwrap().to().unwrap().value.unwrap().cartesian().unwrap()
    };
    let down = of("G1 X0 Y0 Z0 A180 B0 C0\n", Dialect::Iso).pose().rotation;
    // A tool vector points away from the work: z of the tool frame points into it.
    let vector = of("TRAORI\nG1 X0 Y0 Z0 A3=0 B3=0 C3=2 THETA=0\n", Dialect::Siemens).pose().rotation;
    assert!(vector.angle_to(&down) < 1e-9);
    let fanuc = of("G43.5 H1\nG1 X0. Y0. Z0. K1.\n", Dialect::Fanuc).pose().rotation;
    assert!(fanuc.angle_to(&down) < 1e-9);
    let tilted = of("TRAORI\nG1 X0 Y0 Z0 A3=1 C3=1\n", Dialect::Siemens).pose().rotation;
    let axis = tilted * nalgebra::Vector3::z();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    assert!((axis - nalgebra::Vector3::new(-half, 0.0, -half)).norm() < 1e-9, "{axis}");
    let rpy = of("TRAORI ORIRPY\nG1 X0 Y0 Z0 A2=10 B2=20 C2=30\n", Dialect::Siemens).pose().rotation;
    assert!(rpy.angle_to(&Angles::Wpr.rotation([10.0, 20.0, 30.0])) < 1e-9);
}

#[test]
fn control_flow_bypasses_a_subprogram_of_linuxcnc() {
    let sub = "o<shift> sub\nG91 G1 X5\n#1=7\no<shift> endsub\n";
    let before = "G1 X1 Y2 Z3 A0 B0 C0\n#1=4\n";
    let found = ends(&format!("{before}{sub}X#1 Y5\n"), Dialect::LinuxCnc);
    assert_eq!(found, [Ok([1.0, 2.0, 3.0]), Err(Reason::UnknownFlow), Ok([4.0, 5.0, 3.0])]);
    // A call may leave G91 active, and another value of #1.
    let found = ends(&format!("{before}{sub}o<shift> call\nG1 X2 Y5 Z3\n"), Dialect::LinuxCnc);
    assert_eq!(found[2..], [Err(Reason::Subprogram), Err(Reason::UnknownFlow)]);
}

#[test]
fn computed_jumps_and_synchronised_actions_make_everything_unknown() {
    let go = "G1 X1 Y2 Z3 A0 B0 C0\n";
    // A computed jump may go to any numbered block.
    for jump in ["GOTO#5", "GOTO #5", "GOTO [#5+1]"] {
        let body = format!("G90\n{go}#2=4\nN10 #1=3\nG1 X#2 Y2 Z3 A0 B0 C0\n{jump}\n");
        let tree = parse(body.as_bytes(), Dialect::Iso);
        assert!(tree.opaque.is_empty(), "{jump}: {:?}", tree.opaque);
        assert_eq!(ends(&body, Dialect::Iso), [Ok([1.0, 2.0, 3.0]), Err(Reason::UnknownFlow)], "{jump}");
    }
    let action = "N29 ID=1 WHEN $AA_IW[X]>10 DO R5=5\n";
    let body =
        format!("TRAORI\nR5=4\nG1 X=R5 Y2 Z3 A0 B0 C0\n{action}R5=4\nG1 X=R5 Y2 Z3 A0 B0 C0\nX1 Y2 Z3\n");
    assert!(parse(body.as_bytes(), Dialect::Siemens).opaque.is_empty());
    let found = ends(&body, Dialect::Siemens);
    assert_eq!(found[..2], [Ok([4.0, 2.0, 3.0]), Err(Reason::UnknownVariable)]);
    for call in ["G65 <MY_SUB> A1.", "M98 <O1000>"] {
        assert!(parse(call.as_bytes(), Dialect::Fanuc).opaque.is_empty(), "{call}");
    }
}

#[test]
fn at_a_join_only_groups_with_one_value_in_the_file_stay_known() {
    let body = "G90 G1 X1 Y2 Z3 A0 B0 C0\nN10 X2\nG1 X2 Y2 Z2 A0 B0 C0\nIF [#1 GT 5] GOTO 10\nX3\n";
    let found = ends(body, Dialect::LinuxCnc);
    assert_eq!(found[1], Err(Reason::UnknownFlow), "the motion word is forgotten at a jump's aim");
    assert_eq!(found[2], Ok([2.0, 2.0, 2.0]));
    assert_eq!(found[3], Ok([3.0, 2.0, 2.0]));
    // With both G90 and G91 on the paths the meaning of numbers is unknown; what only follows the loop is not on its paths.
    let found = ends(&body.replace("IF", "G91 X1\nIF"), Dialect::LinuxCnc);
    assert_eq!(found[2], Err(Reason::UnknownFlow));
    let found = ends(&format!("{body}G91 X1\n"), Dialect::LinuxCnc);
    assert_eq!(found[2], Ok([2.0, 2.0, 2.0]));
    // So is the value of a variable that is set conditionally.
    let found = ends("#1=5\n#2=4\nIF [#2 EQ 1] THEN #1=7\nG1 X#1 Y2 Z3 A0 B0 C0\nX#2 Y2 Z3\n", Dialect::Iso);
    assert_eq!(found, [Err(Reason::UnknownFlow), Ok([4.0, 2.0, 3.0])]);
    // A skipped block makes uncertain only what it changes.
    let found = ends("G1 X1 Y2 Z3 A0 B0 C0\n/X9\nY5\nX4\n", Dialect::LinuxCnc);
    assert_eq!(found[1..], [Err(Reason::Skippable), Err(Reason::UnknownFlow), Ok([4.0, 5.0, 3.0])]);
}

fn rewrite_as(
    source: &str,
    dialect: Dialect,
    changes: impl FnOnce(&Listing) -> Vec<Change>,
) -> (String, Rewritten) {
    let setup = Setup { dialect: Some(dialect), ..Setup::default() };
    let task = Task::read(&[("x", source.as_bytes())], &setup);
    let rewritten = task.rewrite(&changes(&task.listing), &RewriteOptions::default()).unwrap();
    let text = rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
    (String::from_utf8(text).unwrap(), rewritten)
}

fn change_of(listing: &Listing, motion: u32, by: [f64; 3]) -> Change {
    moved(listing, by).into_iter().find(|change| change.motion == motion).unwrap()
}

#[test]
fn words_keep_their_place_and_omitted_ones_are_added() {
    let source =
        format!("{HEAD}N10 G1 X1 Y2. Z3.00 A0 B0 C0 F100 ; begin\nN20 X 5.5\nN30 M8\nN40 Y-7 (cool)\n");
    let (text, rewritten) =
        rewrite_as(&source, Dialect::LinuxCnc, |listing| vec![change_of(listing, 1, [0.25, 0.125, 0.0])]);
    assert_eq!(rewritten.outcomes, [RewriteOutcome::InPlace]);
    // X in place with enough decimals, Y added; the next, unmodified motion restates X and continues with its own Y.
    let expected = source.replace("X 5.5", "X 5.7500 Y2.1250").replace("Y-7", "X5.5000 Y-7");
    assert_eq!(text, expected);
}

#[test]
fn the_same_values_change_no_byte() {
    for (name, bytes) in &samples() {
        let task = read(name, bytes);
        let mut changes = moved(&task.listing, [3e-11, -2e-11, 0.0]);
        for change in &mut changes {
            for target in &mut change.targets {
                if let NewTarget::Cartesian { quaternion, .. } = target {
                    *quaternion = quaternion.map(|q| -q * (1.0 + 1e-13));
                }
            }
        }
        assert!(name == "plain.nc" || name == "robot.nc" || !changes.is_empty(), "{name}");
        let rewritten = task.rewrite(&changes, &RewriteOptions::default()).unwrap();
        let edits: Vec<_> = rewritten.files[0]
            .edits
            .iter()
            .map(|(range, text)| (range, String::from_utf8_lossy(text).into_owned()))
            .collect();
        assert!(edits.is_empty(), "{name}: {edits:?}");
    }
}

/// Rewrites every motion that can be rewritten and reads the result back: changed motions are at their commanded
/// targets, all others as before.
fn round_trip(name: &str, bytes: &[u8], setup: &Setup, by: [f64; 3], turn_deg: f64) {
    let task = Task::read(&[(name, bytes)], setup);
    let turn =
        nalgebra::UnitQuaternion::from_euler_angles(turn_deg.to_radians(), -0.5 * turn_deg.to_radians(), 0.0);
    let mut changes = moved(&task.listing, by);
    for change in &mut changes {
        for target in &mut change.targets {
            if let NewTarget::Cartesian { quaternion: [w, x, y, z], .. } = target {
                let q = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(*w, *x, *y, *z))
                    * turn;
                (*w, *x, *y, *z) = (q.w, q.i, q.j, q.k);
            }
        }
    }
    // Every third is unmodified, so that modal words must be restated between.
    changes.retain(|change| change.motion % 3 != 2);
    let rewritten = task.rewrite(&changes, &RewriteOptions::default()).unwrap();
    let text = rewritten.files[0].edits.apply(bytes).unwrap();
    let again = Task::read(&[(name, &text[..])], setup);
    assert_eq!(again.listing.motions.len(), task.listing.motions.len(), "{name}");
    for (index, (old, new)) in task.listing.motions.iter().zip(&again.listing.motions).enumerate() {
        let place =
            format!("{name}:{}: {}", old.place.line, String::from_utf8_lossy(&text[new.statement.range()]));
        let change =
            changes.iter().zip(&rewritten.outcomes).find(|(change, _)| change.motion == index as u32);
        let refused = change.is_some_and(|(_, outcome)| matches!(outcome, RewriteOutcome::Refused(_)));
        let change = change.filter(|_| !refused).map(|(change, _)| change);
        if old.own_reason.is_some() && old.own_reason == new.own_reason {
            continue;
        }
        assert_eq!(old.reason(), new.reason(), "{place}");
        for (at, (old, new)) in old.targets.iter().zip(&new.targets).enumerate() {
            let (Ok(old_value), Ok(new_value)) = (old.value, new.value) else {
                assert_eq!(old.value, new.value, "{place}");
                continue;
            };
            let (old_value, new_value) = (old_value.cartesian().unwrap(), new_value.cartesian().unwrap());
            let (wanted, q) = match change.map(|change| change.targets[at]) {
                Some(NewTarget::Cartesian { position_mm, quaternion, .. }) => (position_mm, quaternion),
                _ => (old_value.position_mm, old_value.quaternion),
            };
            if new.role == Role::Via {
                // The midpoint of the new circle need not be the commanded one; the circle passes near it.
                continue;
            }
            for (axis, (new, wanted)) in new_value.position_mm.iter().zip(&wanted).enumerate() {
                let off = new - wanted;
                assert!(off.abs() < 6e-4, "{place}: axis {axis} off by {off} mm");
            }
            let wanted =
                nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]));
            let off = new_value.pose().rotation.angle_to(&wanted).to_degrees();
            assert!(off < 1e-4, "{place}: turned off by {off}°");
        }
    }
}

#[test]
fn written_targets_are_read_back() {
    for (name, bytes) in &samples() {
        round_trip(name, bytes, &Setup::default(), [0.213, -0.117, 0.051], 0.0);
        if name != "linuxcnc.ngc" {
            round_trip(name, bytes, &Setup::default(), [0.213, -0.117, 0.051], 0.08);
        }
    }
}

#[test]
fn arcs_get_a_centre_that_fits_both_ends() {
    for body in ["G3 X0 Y10 I-10 J0", "G2 X0 Y10 R-10", "G3 X0 Y10 Z2 I-10", "G2 I-10 J0"] {
        let source = format!("{HEAD}G17 G1 X10 Y0 Z0 A0 B0 C0\n{body}\nG1 X5\n");
        let (text, rewritten) =
            rewrite_as(&source, Dialect::LinuxCnc, |listing| moved(listing, [0.25, 0.5, 0.0]));
        // A full circle moves with its start: nothing in its block changes.
        let fine = |(at, outcome): (usize, &RewriteOutcome)| {
            *outcome == RewriteOutcome::InPlace || at == 1 && body.starts_with("G2 I")
        };
        assert!(rewritten.outcomes.iter().enumerate().all(fine), "{text} {:?}", rewritten.outcomes);
        let task = Task::read(
            &[("x", text.as_bytes())],
            &Setup { dialect: Some(Dialect::LinuxCnc), ..Setup::default() },
        );
        let old = listing_of(&format!("G17 G1 X10 Y0 Z0 A0 B0 C0\n{body}\nG1 X5\n"), Dialect::LinuxCnc);
        let (old, new) = (via(&old, 1), via(&task.listing, 1));
        for axis in 0..3 {
            assert!(
                (new[axis] - old[axis] - [0.25, 0.5, 0.0][axis]).abs() < 2e-4,
                "{body}: {old:?} {new:?}\n{text}"
            );
        }
    }
}

#[test]
fn blocks_are_inserted_before_a_motion_and_a_mark_after_the_head() {
    let source = "%\nO0001 (TEST)\n(truegrind angles wpr)\n(truegrind tool T0 t [[0,0,100],[1,0,0,0]])\n(truegrind frame G54 w [[500,0,0],[1,0,0,0]])\nG43.4 H1\nN10 G1 X0. Y0. Z0. A180. B0. C0. F600.\nN20 X10. F300.\n%\n";
    let setup = Setup::default();
    let task = Task::read(&[("x", source.as_bytes())], &setup);
    let extra = Extra {
        kind: MotionKind::Linear,
        target: NewTarget::Cartesian {
            position_mm: [5.0, 0.1, 0.0],
            quaternion: [0.0, 1.0, 0.0, 0.0],
            conf: None,
        },
        external: None,
    };
    let change = Change { motion: 1, targets: [NewTarget::Keep].into(), before: vec![extra] };
    let mark_of = Mark { version: "9.9.9".into(), model: "0123456789ab".into(), partial: false };
    let options = RewriteOptions { mark: Some(mark_of.clone()), ..RewriteOptions::default() };
    let rewritten = task.rewrite(&[change], &options).unwrap();
    let text = String::from_utf8(rewritten.files[0].edits.apply(source.as_bytes()).unwrap()).unwrap();
    let expected = source
        .replace("O0001 (TEST)\n", "O0001 (TEST)\n(truegrind 9.9.9 model 0123456789ab)\n")
        .replace("N20 X10.", "G1 X5.0000 Y0.1000 Z0.0000 F300.\nN20 X10. Y0.0000");
    assert_eq!(text, expected);
    let again = Task::read(&[("x", text.as_bytes())], &setup);
    assert_eq!(again.listing.marks, [Some(mark_of)]);
    assert_eq!(mark::read(b"(a comment about truegrind)"), None);
}

#[test]
fn computed_words_become_literals() {
    let source = format!("{HEAD}#1=2\nG1 X[#1*2] Y1 Z#1 A0 B0 C0\n");
    let listing = listing_of("#1=2\nG1 X[#1*2] Y1 Z#1 A0 B0 C0\n", Dialect::LinuxCnc);
    assert_eq!(listing.motions[0].targets[0].origin, Origin::Computed);
    let (text, rewritten) = rewrite_as(&source, Dialect::LinuxCnc, |listing| moved(listing, [0.5, 0.0, 0.0]));
    assert_eq!(rewritten.outcomes, [RewriteOutcome::Inlined]);
    assert_eq!(text, source.replace("X[#1*2]", "X4.5000"));
}

#[test]
fn a_comment_states_the_start_once() {
    let read = |comments: &str| {
        let source = format!("O1\n{comments}G90 G21 G17 G54\nG1 X0. Y0. Z0. F600.\nM30\n");
        Task::read(&[("p.nc", source.as_bytes())], &Setup::default()).listing
    };
    let stated = Some([0.0, 10.5, -5.0, 0.0, 85.0, 180.0]);
    for comments in [
        "(truegrind start [0,10.5,-5,0,85,180])\n",
        "; truegrind START [ 0, 10.5, -5, 0, 85, 180 ]\n",
        "(truegrind start [0,10.5,-5,0,85,180])\n(truegrind start [0,10.5,-5.0,0,85,180])\n",
    ] {
        let listing = read(comments);
        assert_eq!((listing.nc.start_deg, &listing.invalid_statements[..]), (stated, &[][..]), "{comments}");
    }
    assert_eq!(read("(start [0,0,0,0,0,0])\n").nc.start_deg, None);
    for (comment, expected) in [
        ("(truegrind start [0,10.5,-5,0,85])", "in degrees"),
        ("(truegrind start [0,10.5,-5,0,85,nan])", "in degrees"),
        ("(truegrind start [0,10.5,-5,0,85,3601])", "in degrees"),
        ("(truegrind start [0,0.18,-0.09,0,1.48,3.14])", "multiply radians by 57.3"),
        ("(truegrind start)", "in degrees"),
        ("(truegrind stat [0,10.5,-5,0,85,180])", "`truegrind start …`"),
        ("(truegrind start [0,0,0,0,0,0])\n(truegrind start [0,0,0,0,90,0])", "the arm starts once"),
    ] {
        let listing = read(&format!("{comment}\n"));
        let [found] = &listing.invalid_statements[..] else { panic!("{comment}: {listing:?}") };
        assert!(found.to_string().contains(expected), "{found}");
    }
}

/// Without a word of its own, a file may be for a Fanuc, on which G43 leaves X, Y and Z at the end of the arm, or for a LinuxCNC.
#[test]
fn a_comment_states_the_control() {
    let setup = "(truegrind angles wpr)\n(truegrind tool T1 t [[0,0,150],[1,0,0,0]])\n(truegrind frame G54 w [[500,0,200],[1,0,0,0]])\n";
    let read = |name: &str, comments: &str, code: &str| {
        let source = format!(
            "%\n{comments}{setup}{code}G90 G21 G17 G54\nT1 M6\nG43 H1\nG1 X0. Y0. Z0. A180. B0. C0. F600.\nM30\n"
        );
        let task = Task::read(&[(name, source.as_bytes())], &Setup::default());
        (task.dialects[0], task.listing)
    };
    let (dialect, listing) = read("p.nc", "", "");
    assert_eq!((dialect, listing.nc.open_controls.len()), (Dialect::Iso, 1));
    assert_eq!(listing.nc.open_controls[0].line, 8);
    for (word, expected, reason) in [
        ("fanuc", Dialect::Fanuc, Some(Reason::NoTcpMode)),
        ("LinuxCNC", Dialect::LinuxCnc, None),
        ("iso", Dialect::Iso, None),
    ] {
        let (dialect, listing) = read("p.nc", &format!("(truegrind control {word})\n"), "");
        assert_eq!((dialect, listing.motions[0].reason()), (expected, reason), "{word}");
        assert!(listing.nc.open_controls.is_empty() && listing.invalid_statements.is_empty(), "{listing:?}");
    }
    // Words that no LinuxCNC has, and a program number behind a block number.
    for code in ["N1 O0101\n", "G54.1 P2\n", "G187 P1\n"] {
        assert_eq!(read("p.nc", "", code).0, Dialect::Fanuc, "{code}");
    }
    for (comments, expected) in [
        ("(truegrind control haas)\n", "one of fanuc, siemens"),
        ("(truegrind control)\n", "one of fanuc"),
        ("(truegrind control fanuc)\n(truegrind control iso)\n", "one control runs the file"),
    ] {
        let (_, listing) = read("p.nc", comments, "");
        let [found] = &listing.invalid_statements[..] else { panic!("{comments}: {listing:?}") };
        assert!(found.to_string().contains(expected), "{found}");
    }
    // A cell file overrides the comment.
    let source = b"(truegrind control fanuc)\nG1 X0 Y0 Z0\n";
    let stated = Setup { dialect: Some(Dialect::LinuxCnc), ..Setup::default() };
    let task = Task::read(&[("p.nc", source)], &stated);
    assert!(task.dialects[0] == Dialect::LinuxCnc && task.listing.invalid_statements.is_empty());
}

#[test]
fn further_axes_are_listed_with_their_first_block() {
    for (dialect, block, letter) in [
        (Dialect::Siemens, "G1 X9 U10", 'U'),
        (Dialect::Heidenhain, "L X+9 W+5", 'W'),
        (Dialect::LinuxCnc, "G1 X9 V1", 'V'),
    ] {
        let listing = listing_of(&format!("G1 X1 Y2 Z3\n{block}\n"), dialect);
        assert_eq!(listing.nc.other_axes.keys().copied().collect::<Vec<_>>(), [letter], "{block}");
    }
    // On a Fanuc they are increments of X, Y and Z, which are refused.
    assert!(listing_of("G1 X1 U2\n", Dialect::Fanuc).nc.other_axes.is_empty());
}

#[test]
fn the_mark_stands_behind_that_of_utf_8() {
    let source = "\u{feff}; first\nG1 X1 Y2 Z3\n";
    let task = Task::read(&[("x.mpf", source.as_bytes())], &Setup::default());
    assert_eq!(mark::place(&task.trees[0], Dialect::Siemens), 3);
}

/// A Fanuc 30i takes a comment before the name for the program's first block.
#[test]
fn the_mark_stands_behind_the_name_of_a_program() {
    for head in ["%\n<FACE>\n", "%\r\n<FACE> (ROUGH)\r\n", "%\nO0101\n", "%\n:0101\n"] {
        let source = format!("{head}(truegrind angles wpr)\nG43.4 H1\nG1 X1. Y2. Z3.\n%\n");
        let task = Task::read(&[("x.nc", source.as_bytes())], &Setup::default());
        assert_eq!(mark::place(&task.trees[0], Dialect::Fanuc), head.len(), "{head}");
    }
}

/// `;` ends a block on a Fanuc: "X5. ; Y7." was read as one block with a comment, and Y7. was left out without a word. An unclosed comment
/// swallows the blocks behind it.
#[test]
fn what_stands_behind_the_end_of_a_block_or_in_an_unclosed_comment_is_unreadable() {
    let read = |dialect: Dialect, block: &str| {
        let source = format!("G90 G1 X1. Y2. Z3.\n{block}\nY9.\n");
        let setup = Setup { dialect: Some(dialect), ..Setup::default() };
        let listing = Task::read(&[("p.nc", source.as_bytes())], &setup).listing;
        listing.opaque.first().map(|region| region.place.line)
    };
    for block in ["X5. ; Y7.", "X5.;Y7.", "X5. ; D10", "X5. (to the edge"] {
        assert_eq!(read(Dialect::Fanuc, block), Some(2), "{block}");
    }
    for block in ["X5. ;", "X5. ; ", "X5. ; (to the edge)", "; Y7.", "X5. (to the edge)"] {
        assert_eq!(read(Dialect::Fanuc, block), None, "{block}");
    }
    assert_eq!(read(Dialect::LinuxCnc, "X5. ; Y7."), None);
    assert_eq!(read(Dialect::LinuxCnc, "X5. (to the edge"), Some(2));
}

/// On LinuxCNC T and M6 alone leave the length of a tool out; it was assumed to be active, and the result was "ok".
#[test]
fn a_tool_whose_length_nothing_takes_over_is_told() {
    let tool = Frame { position_mm: [0.0, 0.0, 120.0], quaternion: [1.0, 0.0, 0.0, 0.0] };
    let lines = |dialect: Dialect, code: &str| {
        let mut setup = Setup { dialect: Some(dialect), ..Setup::default() };
        setup.tools.push(("T1".to_owned(), tool));
        setup.frames.push(("G54".to_owned(), Frame::IDENTITY));
        let source = format!("(truegrind angles wpr)\nG90 G21 G54\n{code}G1 X1 Y2 Z3 A180 B0 C0 F600\nX5\n");
        let listing = Task::read(&[("p.ngc", source.as_bytes())], &setup).listing;
        listing.nc.unstated_lengths.iter().map(|place| place.line).collect::<Vec<_>>()
    };
    assert_eq!(lines(Dialect::LinuxCnc, "T1 M6\n"), [4]);
    for code in ["T1 M6\nG43\n", "T1 M6\nG43 H1\n", "T1 M6\nG 43.1 Z5\n", "G49\nT1 M6\n", ""] {
        assert_eq!(lines(Dialect::LinuxCnc, code), [0_u32; 0], "{code}");
    }
    assert_eq!(lines(Dialect::Iso, "T1 M6\n"), [0_u32; 0]);
}

/// The turn about a tool vector decides on the joints of a six-axis arm; where no word states it, it was taken as 0, and the result was "ok".
#[test]
fn a_turn_about_the_tool_vector_that_no_word_states_is_told() {
    let lines = |dialect: Dialect, blocks: &str| {
        let mut setup = Setup { dialect: Some(dialect), ..Setup::default() };
        setup.tools.push(("T1".to_owned(), Frame::IDENTITY));
        setup.frames.push(("G54".to_owned(), Frame::IDENTITY));
        let listing = Task::read(&[("p.nc", blocks.as_bytes())], &setup).listing;
        listing.nc.unstated_turns.iter().map(|place| place.line).collect::<Vec<_>>()
    };
    let siemens = "G90 G71 G17 G54\nT1 D1 M6\nTRAORI\nG1 X0 Y0 Z0 A3=0 B3=0 C3=1 F600\nX5\n";
    assert_eq!(lines(Dialect::Siemens, siemens), [4]);
    assert_eq!(lines(Dialect::Siemens, &siemens.replace("C3=1", "C3=1 THETA=0")), [0_u32; 0]);
    let angles = siemens.replace("A3=0 B3=0 C3=1", "A180 B0 C0");
    assert_eq!(lines(Dialect::Siemens, &format!("; truegrind angles wpr\n{angles}")), [0_u32; 0]);
}
