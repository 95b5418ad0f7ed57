//! A thousand corrected executions of each language, a fixed share of what the example runs.

use truegrind_differential::outcome::Dialect;
use truegrind_differential::rapid::Features;
use truegrind_differential::report;

#[test]
fn a_thousand_corrected_executions_of_each_language_agree() {
    let mut wrong = Vec::new();
    for (dialect, tally, _) in report::many(&Dialect::ALL, 0, 1000 * Dialect::ALL.len(), Features::ALL) {
        println!("{}", report::line(dialect.name(), &tally, 0.0));
        assert!(tally.corrected >= 1000, "{}: {} corrected", dialect.name(), tally.corrected);
        wrong.extend(tally.disagreements.iter().map(ToString::to_string));
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

/// The class: a displacement that counts from where the robot stands. What stood there before must go on standing there, on
/// every way that leads to it.
#[test]
fn displacements_from_where_the_robot_stands_agree() {
    let all = report::many(&[Dialect::Rapid], 9_000_000, 400, Features::MORE);
    let wrong: Vec<String> =
        all.iter().flat_map(|one| &one.1.disagreements).map(ToString::to_string).collect();
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

/// The class: makers count joints the other way round, or the third from the horizontal. Where an NC program begins is in the cell file;
/// only what no text tells, as the way behind a probe, stays open.
#[test]
fn joints_that_are_counted_otherwise_agree() {
    agree(Features { mapped: true, ..Features::ALL }, 9_100_000, 1000);
}

/// A base that tilts under the arm and its load, an axis that wobbles.
#[test]
fn arms_whose_links_move_agree() {
    agree(Features { loose: true, ..Features::ALL }, 9_200_000, 400);
}

/// Programs from a seed on agree; of each language so many corrected motions are wanted.
fn agree(features: Features, seed: u64, wanted: usize) {
    for (dialect, tally, _) in report::many(&Dialect::ALL, seed, wanted * Dialect::ALL.len(), features) {
        println!("{}", report::line(dialect.name(), &tally, 0.0));
        assert!(tally.corrected >= wanted, "{}: {} corrected", dialect.name(), tally.corrected);
        assert!(tally.open <= tally.corrected / 20, "{}: {} open", dialect.name(), tally.open);
        let wrong: Vec<String> = tally.disagreements.iter().map(ToString::to_string).collect();
        assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
    }
}

/// Programs in which original and correction once disagreed: units, shifts, tools and increments in doubt where ways meet; a
/// shift of G92 under radius compensation; a whole circle with play; a joint that seemed to turn near the end of a line; a
/// tool taught at poses whose least squares came out wrong; joints with play that turn where the wrist goes by itself, or on
/// straight pieces and not on their arc; targets put in on a way that the arm cannot go; an arc whose path has a corner
/// where a play is taken up; a load that is another by a computed call; a circle point that is passed with the tool turned
/// otherwise than it is told there; an arc that stays and whose ends come to lie apart, or that
/// passes a singularity from a corrected start; a configuration that may not be checked; a part that is
/// held to a tool that stands, off where the two touch; a corrected coordinate that comes in through another axis of a turned frame;
/// an angle that increments bring back but for the last bit, behind a block that may be skipped;
/// a turn about the tool that a block states which is left; a work offset that a called program has set; sides of play told from
/// guessed joints; a way so near to a singularity that joints are fast, or past it on the other side by a whole turn; an arc at the
/// border of what a controller takes for one; angles left out under a tool that is turned otherwise; a configuration that is
/// checked in the first cycle alone; a motion that is left behind a flagged guess with which the arm came elsewhere; a shift of
/// which one axis is not told; a block whose numbers stand since G92 makes a corrected place the zero;
/// a rapid move before a cycle that M99 calls, which stays where the tool is in the axes that it omits.
const ONCE_WRONG: [(Dialect, u64); 76] = [
    (Dialect::Heidenhain, 246_440_601),
    (Dialect::Rapid, 242_700_007),
    (Dialect::Fanuc, 242_400_218),
    (Dialect::Siemens, 242_400_060),
    (Dialect::Siemens, 242_310_385),
    (Dialect::Rapid, 238_001_240),
    (Dialect::Rapid, 237_300_699),
    (Dialect::Rapid, 230_100_746),
    (Dialect::Fanuc, 229_300_743),
    (Dialect::Fanuc, 219_800_282),
    (Dialect::LinuxCnc, 227_700_167),
    (Dialect::LinuxCnc, 217_900_257),
    (Dialect::Rapid, 227_600_055),
    (Dialect::Rapid, 226_300_653),
    (Dialect::Rapid, 220_300_740),
    (Dialect::Rapid, 221_000_520),
    (Dialect::Rapid, 212_200_116),
    (Dialect::Rapid, 212_200_043),
    (Dialect::Rapid, 202_800_034),
    (Dialect::Rapid, 202_630_066),
    (Dialect::Rapid, 200_770_021),
    (Dialect::Rapid, 200_130_041),
    (Dialect::Rapid, 99_109_410),
    (Dialect::Fanuc, 99_101_303),
    (Dialect::Rapid, 75_122_364),
    (Dialect::LinuxCnc, 75_003_632),
    (Dialect::Rapid, 72_012_597),
    (Dialect::Rapid, 72_002_671),
    (Dialect::Rapid, 74_004_353),
    (Dialect::Rapid, 72_001_316),
    (Dialect::Fanuc, 72_017_982),
    (Dialect::Siemens, 72_010_984),
    (Dialect::Rapid, 71_018_673),
    (Dialect::Rapid, 64_006_661),
    (Dialect::Fanuc, 60_001_877),
    (Dialect::Fanuc, 60_009_435),
    (Dialect::Fanuc, 60_015_894),
    (Dialect::Fanuc, 60_017_435),
    (Dialect::Fanuc, 1_001_909),
    (Dialect::Fanuc, 1_001_375),
    (Dialect::Fanuc, 1_018_769),
    (Dialect::Fanuc, 1_007_094),
    (Dialect::Fanuc, 1_000_556),
    (Dialect::LinuxCnc, 1_008_445),
    (Dialect::LinuxCnc, 5_001_327),
    (Dialect::LinuxCnc, 244_001_214),
    (Dialect::Siemens, 1_016_406),
    (Dialect::Siemens, 1_000_172),
    (Dialect::Siemens, 1_017_853),
    (Dialect::Siemens, 1_000_218),
    (Dialect::Siemens, 40_002_739),
    (Dialect::Siemens, 60_004_757),
    (Dialect::Rapid, 93),
    (Dialect::Rapid, 293),
    (Dialect::Rapid, 573),
    (Dialect::Rapid, 1170),
    (Dialect::Rapid, 1516),
    (Dialect::Rapid, 2011),
    (Dialect::Rapid, 2773),
    (Dialect::Rapid, 7860),
    (Dialect::Rapid, 1_000_129),
    (Dialect::Rapid, 1_000_647),
    (Dialect::Rapid, 1_001_171),
    (Dialect::Rapid, 1_001_813),
    (Dialect::Rapid, 1_007_146),
    (Dialect::Rapid, 3_000_387),
    (Dialect::Rapid, 3_004_043),
    (Dialect::Rapid, 5_004_543),
    (Dialect::Rapid, 5_005_503),
    (Dialect::Rapid, 6_008_145),
    (Dialect::Rapid, 6_010_047),
    (Dialect::Rapid, 6_017_382),
    (Dialect::Rapid, 8_120_664),
    (Dialect::Rapid, 40_005_161),
    (Dialect::Rapid, 40_010_979),
    (Dialect::Rapid, 41_008_319),
];

#[test]
fn programs_that_once_disagreed_agree() {
    let wrong: Vec<String> = ONCE_WRONG
        .iter()
        .flat_map(|(dialect, seed)| report::run(*dialect, *seed, Features::ALL).disagreements)
        .map(|disagreement| disagreement.to_string())
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
