//! What became of each motion: the contract field by field, reasons, coverage, page.

use std::collections::BTreeSet;

use serde_json::Value;
use truegrind_arm::inverse::InverseError;
use truegrind_arm::model::Limited;
use truegrind_compensation::deviation::MotionStatus;
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::plan::{MotionOutcome, Plan};
use truegrind_compensation::risk::cut_risk::CutRisk;
use truegrind_compensation::risk::placement::{ObjectPlacement, Placement};
use truegrind_math::option_f64::OptionF64;
use truegrind_programs::motion::{Frame, Listing, Mark, Reason, ReplacedFrame};
use truegrind_programs::rapid::Task;
use truegrind_report::compensation::{self as view, ProgramFile};
use truegrind_report::format::{csv, markdown, terminal};
use truegrind_report::placement::sentences;

use super::examples::leave;

const PROGRAM: &[u8] = b"MODULE Grind
  CONST robtarget p1:=[[400,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget home:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveAbsJ home,v100,fine,tool0;
    MoveJ p1,v100,fine,tool0;
    MoveL Offs(p1,10,0,0),v50,z1,tool0;
    MoveL Offs(p1,20,0,0),v50,z1,tool0;
    MoveL Offs(p1,30,0,0),v50,z1,tool0;
    MoveL Offs(p1,40,0,0),v50,z1,tool0;
  ENDPROC
  what is this ???;
ENDMODULE
";

const SECOND: &[u8] = b"MODULE Other
  PROC other()
    MoveL [[400,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z1,tool0;
  ENDPROC
ENDMODULE
";

fn outcome(motion: u32, status: MotionStatus, reason: Option<OutcomeReason>) -> MotionOutcome {
    MotionOutcome {
        motion,
        status,
        reason: reason.map(Box::new),
        before_mm: 1.5.into(),
        after_mm: if status == MotionStatus::Changed { 0.0004 } else { 1.5 }.into(),
        sigma_mm: 0.12.into(),
        shape_sigma_mm: OptionF64::NONE,
        path_deviation_mm: OptionF64::NONE,
        inserted: 0,
    }
}

/// Seven motions, one of each fate and more.
fn example() -> (Plan, Listing, Vec<ProgramFile>) {
    let task = Task::read(&[("grind.mod", PROGRAM), ("other.mod", SECOND)]);
    let mut outcomes = vec![
        outcome(0, MotionStatus::Left, Some(OutcomeReason::JointTarget)),
        outcome(1, MotionStatus::Changed, None),
        outcome(2, MotionStatus::Flagged, Some(OutcomeReason::JointNotMeasured { joint: 4, by_deg: 5.0 })),
        outcome(3, MotionStatus::Flagged, Some(OutcomeReason::JointNotMeasured { joint: 4, by_deg: 7.25 })),
        outcome(4, MotionStatus::Refused, Some(OutcomeReason::CorrectionTooLarge { mm: 12.345 })),
        outcome(
            5,
            MotionStatus::Refused,
            Some(OutcomeReason::Inverse(InverseError::Unreachable { beyond_mm: f64::NAN })),
        ),
        outcome(6, MotionStatus::Left, Some(OutcomeReason::Program(Reason::Displacement))),
    ];
    outcomes[0].before_mm = OptionF64::NONE;
    outcomes[0].after_mm = OptionF64::NONE;
    outcomes[0].sigma_mm = OptionF64::NONE;
    outcomes[1].inserted = 2;
    let plan = Plan {
        outcomes,
        notes: vec!["tool disc: origin not stated, taken as metrology".to_owned()],
        ..Plan::default()
    };
    let files = vec![
        ProgramFile {
            file: "grind.mod".to_owned(),
            output: Some("out/grind.mod".to_owned()),
            unchanged: false,
        },
        ProgramFile { file: "other.mod".to_owned(), output: None, unchanged: true },
    ];
    (plan, task.listing, files)
}

fn keys(value: &Value) -> BTreeSet<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

#[test]
fn the_json_is_the_contract_field_by_field() {
    let (plan, listing, files) = example();
    assert_eq!(listing.motions.len(), 7);
    let json = view::json(&plan, &listing, &files);
    assert_eq!(
        keys(&json),
        BTreeSet::from(["schema", "verdict", "programs", "placements", "cuts", "chance_of_worse"])
    );
    assert_eq!(keys(&json["verdict"]), BTreeSet::from(["status", "headline"]));
    assert_eq!(json["schema"], "truegrind.compensation/1");
    let programs = json["programs"].as_array().unwrap();
    assert_eq!(programs.len(), 2);
    for program in programs {
        assert_eq!(
            keys(program),
            BTreeSet::from(["file", "output", "unchanged", "opaque_regions", "motions"])
        );
        for region in program["opaque_regions"].as_array().unwrap() {
            assert_eq!(keys(region), BTreeSet::from(["line", "reason"]));
        }
        for motion in program["motions"].as_array().unwrap() {
            assert_eq!(
                keys(motion),
                BTreeSet::from([
                    "line",
                    "instruction",
                    "status",
                    "reason",
                    "before_mm",
                    "after_mm",
                    "sigma_mm",
                    "shape_sigma_mm"
                ])
            );
            assert!(["changed", "left", "refused", "flagged"].contains(&motion["status"].as_str().unwrap()));
        }
    }
    assert_eq!(programs[0]["file"], "grind.mod");
    assert_eq!(programs[0]["output"], "out/grind.mod");
    assert!(programs[1]["output"].is_null(), "nothing was written");
    assert_eq!((&programs[0]["unchanged"], &programs[1]["unchanged"]), (&false.into(), &true.into()));
    assert_eq!(programs[0]["motions"].as_array().unwrap().len(), 6);
    assert_eq!(programs[1]["motions"].as_array().unwrap().len(), 1);
    assert_eq!(programs[1]["motions"][0]["line"], 3);
    let motion = &programs[0]["motions"][0];
    assert_eq!(motion["line"], 5);
    assert_eq!(motion["instruction"], "MoveAbsJ");
    assert!(motion["before_mm"].is_null() && motion["sigma_mm"].is_null(), "absent is null, never 0");
    assert!(programs[0]["motions"][1]["reason"].is_null());
    assert_eq!(programs[0]["motions"][1]["after_mm"], 0.0004);
    assert_eq!(
        programs[0]["motions"][4]["reason"],
        OutcomeReason::CorrectionTooLarge { mm: 12.345 }.to_string()
    );
    let opaque = programs[0]["opaque_regions"].as_array().unwrap();
    assert!(!opaque.is_empty() && opaque[0]["line"] == 12, "{opaque:?}");
}

#[test]
fn reasons_are_counted_with_their_worst_and_their_first_lines() {
    let (plan, listing, files) = example();
    let text = csv::table(&view::reason_table(&plan, &listing, &files)).replace('\r', "");
    let expected = "\
status,motions,reason,worst,lines
refused,1,correction exceeds the bound (--max-correction),12.345 mm,grind.mod 9
refused,1,target is out of reach,,grind.mod 10
flagged,2,a joint is outside the range in which the arm was measured (joint 5),7.25°,grind.mod 7–8
left,1,\"joint target: states joints, not a pose (--joint-targets rewrites it too)\",,grind.mod 5
left,1,a program displacement or external axis offset is or may be active,,other.mod 3
";
    assert_eq!(text, expected);
}

#[test]
fn lines_of_successive_motions_are_a_range_and_many_ranges_are_cut_short() {
    let (mut plan, listing, files) = example();
    let mut lines = |motions: &[u32]| {
        let left = |motion: &u32| {
            outcome(*motion, MotionStatus::Left, Some(OutcomeReason::Risk { chance: 0.64404 }))
        };
        plan.outcomes = motions.iter().map(left).collect();
        csv::table(&view::reason_table(&plan, &listing, &files))
    };
    let text = lines(&[0, 1, 2, 3, 5, 6]);
    assert!(text.contains(",64 %,\"grind.mod 5–8, 10; other.mod 3\""), "{text}");
    let text = lines(&[0, 2, 0, 2, 0, 2, 4, 5]);
    assert!(text.contains("\"grind.mod 5, 7, 5, 7, 5, 7 and 2 more motions\""), "{text}");
}

#[test]
fn a_cut_that_stays_names_the_line_that_caused_it() {
    let (mut plan, listing, files) = example();
    let part = |line| Some(OutcomeReason::PartOfCut { line, because: "target is out of reach" });
    plan.outcomes = vec![
        outcome(2, MotionStatus::Refused, part(9)),
        outcome(3, MotionStatus::Refused, part(9)),
        outcome(5, MotionStatus::Refused, Some(OutcomeReason::Step { line: 9, mm: 0.5 })),
    ];
    let text = csv::table(&view::reason_table(&plan, &listing, &files[..1]));
    assert!(text.contains("of this cut is not corrected: target is out of reach (line 9)"), "{text}");
    assert!(text.contains("would exceed --tolerance (line 9),0.500 mm,10"), "{text}");
}

/// Each made a group of its own, since their sentences name lines: a page with as many rows.
#[test]
fn motions_that_are_kept_for_the_sake_of_others_share_a_group_whatever_the_line() {
    let (mut plan, listing, files) = example();
    let for_other: [fn(u32) -> OutcomeReason; 7] = [
        |line| OutcomeReason::HalfTurn { line },
        |line| OutcomeReason::ArcFromUncorrected { line },
        |line| OutcomeReason::StartOfUnchangedArc { line },
        |line| OutcomeReason::StartOfUnchangedCut { line },
        |line| OutcomeReason::DepartureFromUnchangedCut { line },
        |line| OutcomeReason::StartOfSingularPath { line },
        |line| OutcomeReason::StartOfLimitedPath { line, what: Limited::joint(2) },
    ];
    for (index, reason) in for_other.iter().enumerate() {
        plan.outcomes =
            (0..7).map(|motion| outcome(motion, MotionStatus::Refused, Some(reason(20 + motion)))).collect();
        let table = view::reason_table(&plan, &listing, &files[..1]);
        assert_eq!(table.rows.len(), 1, "{index}");
        let text = csv::table(&table);
        assert!(text.contains("lines 20, 21, 22, 23 and 3 more)"), "{text}");
        assert_eq!(text.contains("joint 3, lines"), index == 6, "{text}");
    }
}

#[test]
fn a_reason_that_rows_share_is_printed_once() {
    let (mut plan, listing, files) = example();
    let left = |motion| outcome(motion, MotionStatus::Left, Some(OutcomeReason::Risk { chance: 0.5 }));
    plan.outcomes = (0..4).map(left).collect();
    let page = view::document(&plan, &listing, &files[..1], &[]);
    let text = markdown::document(&page);
    assert_eq!(text.matches("worse with a probability of 50 %").count(), 2, "both tables: {text}");
    assert_eq!(text.matches("as above").count(), 6, "{text}");
    // Data files repeat it.
    let rows = csv::table(&view::table(&plan, &listing, &files[..1]));
    assert_eq!(rows.matches("worse with a probability of 50 %").count(), 4, "{rows}");
}

#[test]
fn the_table_has_a_row_for_each_motion_and_dashes_for_what_is_not_known() {
    let (plan, listing, files) = example();
    let table = view::table(&plan, &listing, &files);
    assert_eq!(table.rows.len(), 7);
    let text = terminal::table(&table, 220);
    let words = |instruction: &str| -> Vec<String> {
        let line = text.lines().find(|line| line.contains(instruction)).unwrap();
        line.split_whitespace().map(str::to_owned).take(10).collect()
    };
    let unknown = ["grind.mod", "5", "MoveAbsJ", "○", "left", "–", "–", "–", "–", "–"];
    assert_eq!(words("MoveAbsJ"), unknown, "{text}");
    let changed = ["grind.mod", "6", "MoveJ", "✓", "changed", "1.500", "0.0004", "–", "0.120", "–"];
    assert_eq!(words("MoveJ "), changed, "{text}");
    // One file needs no column for it.
    assert_eq!(view::table(&plan, &listing, &files[..1]).columns[0].key, "line");
}

#[test]
fn coverage_counts_and_never_rounds_to_all_or_nothing() {
    let (mut plan, ..) = example();
    assert_eq!(
        view::coverage(&plan),
        "7 motions: 3 corrected (42.9 %), of which 2 are flagged; 2 refused (28.6 %); 2 left (28.6 %)"
    );
    plan.outcomes = (0..100_000)
        .map(|i| outcome(i, if i == 0 { MotionStatus::Refused } else { MotionStatus::Changed }, None))
        .collect();
    assert_eq!(
        view::coverage(&plan),
        "100000 motions: 99999 corrected (> 99.9 %); 1 refused (< 0.1 %); 0 left (0 %)"
    );
    plan.outcomes.clear();
    assert_eq!(view::coverage(&plan), "the program contains no motion");
}

#[test]
fn verdict_and_page_tell_what_to_look_at() {
    let (mut plan, mut listing, files) = example();
    let text = terminal::document(&view::summary(&plan, &listing, &files), 200);
    assert!(text.contains("[warning] Corrected, but check the refused and flagged motions"), "{text}");
    assert!(text.contains("the path steps by the size of the correction"), "{text}");
    assert!(text.contains("2 targets inserted"), "{text}");
    assert!(text.contains("- tool disc: origin not stated"), "{text}");
    assert!(text.contains("written to out/grind.mod"), "{text}");
    let page = leave("compensation.html", &view::document(&plan, &listing, &files, &[]));
    assert!(page.contains(">Motions</h2>") && page.contains(">Regions that could not be read</h2>"));
    plan.outcomes.iter_mut().for_each(|outcome| outcome.status = MotionStatus::Changed);
    let text = terminal::document(&view::summary(&plan, &listing, &files), 200);
    assert!(text.contains("[warning] Corrected, but parts of the program could not be read"), "{text}");
    listing.opaque.clear();
    for (axes, loads, sentence) in [
        (vec!['a'], 0, "[warning] Corrected as if the robot base never moves"),
        (vec![], 2, "[warning] Corrected, but where GripLoad sets the load"),
    ] {
        let plan = Plan { unstated_axes: axes, unknown_loads: loads, ..plan.clone() };
        let text = terminal::document(&view::summary(&plan, &listing, &files), 200);
        assert!(text.contains(sentence), "{text}");
    }
    let other = Plan { other_loads: 1, ..plan.clone() };
    let text = terminal::document(&view::summary(&other, &listing, &files), 200);
    assert!(text.contains("[warning] Corrected, but the program carries another load"), "{text}");
    let heavy = Plan { is_overloaded: true, ..plan.clone() };
    let text = terminal::document(&view::summary(&heavy, &listing, &files), 200);
    assert!(text.contains("[warning] Corrected for a mass far above what the robot is rated for"), "{text}");
    let inverted = Plan { has_tip_in_wrist: true, ..plan.clone() };
    let text = terminal::document(&view::summary(&inverted, &listing, &files), 200);
    assert!(text.contains("[warning] Corrected for a tool whose tip lies within the wrist"), "{text}");
    let mut open = listing.clone();
    open.nc.unstated_lengths = vec![listing.motions[0].place];
    let text = terminal::document(&view::summary(&plan, &open, &files), 200);
    assert!(text.contains("[warning] Corrected as if the tool length were active"), "{text}");
    let mut turned = listing.clone();
    turned.nc.unstated_turns = vec![listing.motions[0].place];
    let text = terminal::document(&view::summary(&plan, &turned, &files), 200);
    assert!(text.contains("[warning] Corrected as if the turn about the tool vector were 0"), "{text}");
    let mut replaced = listing.clone();
    let (set, stated) = (Frame::IDENTITY, Frame { position_mm: [0.0, 0.0, 10.0], ..Frame::IDENTITY });
    let frame = ReplacedFrame { name: "G54".to_owned(), set, stated };
    replaced.nc.replaced_frames.insert(listing.motions[0].place, frame);
    let text = terminal::document(&view::summary(&plan, &replaced, &files), 200);
    assert!(text.contains("[warning] Corrected, but the program sets a tool or work offset"), "{text}");
    let mut several = listing.clone();
    several.mains = vec![listing.motions[0].place; 2];
    let text = terminal::document(&view::summary(&plan, &several, &files), 200);
    assert!(text.contains("[warning] Corrected as one task, but several files begin a program"), "{text}");
    let assumed = Plan { assumes_origins: true, ..plan.clone() };
    let text = terminal::document(&view::summary(&assumed, &listing, &files), 200);
    assert!(
        text.contains(
            "[ok] All correctable motions are corrected: the program may run if tools and work objects"
        ),
        "{text}"
    );
    let last = listing.motions.len() as u32 - 1;
    for (call, is_depended_on) in [(0, true), (last, false)] {
        let mut called = listing.clone();
        called.nc.external_calls = vec![call];
        let text = terminal::document(&view::summary(&plan, &called, &files), 200);
        assert_eq!(
            text.contains("[warning] Corrected, but a call of another program may change the modal state"),
            is_depended_on,
            "{text}"
        );
    }
    for (status, sentence) in [
        (MotionStatus::Changed, "[ok] All correctable motions are corrected"),
        (MotionStatus::Left, "[not evaluated] Nothing was corrected"),
        (MotionStatus::Refused, "[failed] Nothing could be corrected"),
    ] {
        plan.outcomes.iter_mut().for_each(|outcome| outcome.status = status);
        let text = terminal::document(&view::summary(&plan, &listing, &files), 200);
        assert!(text.contains(sentence), "{text}");
    }
}

/// The bound of a probability followed from the first word of its text, and "at most over 99.9 %" is none.
#[test]
fn a_probability_that_is_a_bound_by_itself_gets_no_other() {
    let (mut plan, listing, files) = example();
    let mut said = |probability_of_harm: f64| {
        plan.probability_of_harm = Some(probability_of_harm);
        plan.cuts = vec![CutRisk {
            motions: vec![1],
            assessed: Placement::Shape,
            deviation_mm: 1.0,
            sigma_mm: 0.1,
            shape_sigma_mm: 0.1,
            probability_of_harm,
            left_for_risk: false,
            corrected: true,
        }];
        terminal::document(&view::summary(&plan, &listing, &files), 300)
    };
    for (probability, words) in [(1e-9, "under 0.1 %"), (0.097, "at most 9.7 %"), (1.0, "over 99.9 %")] {
        let text = said(probability);
        assert!(text.contains(&format!("for any single cut: {words}\n")), "{text}");
    }
}

/// A work object is said to be corrected only where a motion with it is.
#[test]
fn a_work_object_without_a_corrected_motion_is_not_called_corrected() {
    let (mut plan, listing, _) = example();
    plan.placements = vec![ObjectPlacement {
        work_object: "wobj0".to_owned(),
        applied: Placement::Absolute,
        deviation_mm: 2.131,
        sigma_mm: 0.2,
        probability_of_harm: 0.01,
        taught: false,
        unlocated: false,
        others: Vec::new(),
        held: false,
        remedy: None,
    }];
    let said = |plan: &Plan| sentences(plan, &listing).join("\n");
    assert!(
        said(&plan)
            .contains("wobj0: shape and placement are corrected in 3 of 7 motions; the path as a whole")
    );
    plan.outcomes.iter_mut().for_each(|outcome| outcome.status = MotionStatus::Left);
    let text = said(&plan);
    assert!(
        text.contains("wobj0: no motion with it is corrected; the path as a whole is displaced by 2.131 mm"),
        "{text}"
    );
}

/// Two passes over one contour of which one was left came apart by the correction without a word.
#[test]
fn cuts_that_stay_behind_are_named() {
    let (mut plan, listing, _) = example();
    let cut = |motion: u32, corrected: bool| CutRisk {
        motions: vec![motion],
        assessed: Placement::Absolute,
        deviation_mm: 1.121,
        sigma_mm: 0.1,
        shape_sigma_mm: 0.01,
        probability_of_harm: 0.0,
        left_for_risk: false,
        corrected,
    };
    plan.placements = vec![ObjectPlacement {
        work_object: "wobj0".to_owned(),
        applied: Placement::Absolute,
        deviation_mm: 1.1,
        sigma_mm: 0.1,
        probability_of_harm: 0.0,
        taught: false,
        unlocated: false,
        others: Vec::new(),
        held: false,
        remedy: None,
    }];
    let said = |plan: &Plan| sentences(plan, &listing).join("\n");
    plan.cuts = vec![cut(0, true), cut(2, false)];
    let text = said(&plan);
    assert!(text.contains("wobj0: the cut that begins at line "), "{text}");
    assert!(text.contains("passes over one contour then lie up to 1.121 mm apart"), "{text}");
    for corrected in [true, false] {
        plan.cuts = vec![cut(0, corrected), cut(2, corrected)];
        assert!(!said(&plan).contains("apart"), "{corrected}");
    }
    // Of a line that is left the text does not tell the place: it is off by what the path as a whole is.
    plan.cuts = vec![cut(1, true)];
    let left = plan.outcomes.iter().position(|outcome| outcome.motion == 6).unwrap();
    plan.outcomes[left].before_mm = OptionF64::NONE;
    let text = said(&plan);
    assert!(text.contains("wobj0: what is cut at line "), "{text}");
    assert!(text.contains("passes over one contour then lie up to 1.100 mm apart"), "{text}");
    let counted = Some(OutcomeReason::Program(Reason::CurrentPosition));
    let mut lifted = plan.clone();
    lifted.outcomes[left] = outcome(6, MotionStatus::Left, counted);
    lifted.outcomes[left].before_mm = OptionF64::NONE;
    assert!(!said(&lifted).contains("apart"));
    // Where the shape alone is corrected, they do not move against each other.
    plan.cuts = vec![cut(0, true), cut(2, false)];
    plan.placements[0].applied = Placement::Shape;
    assert!(!said(&plan).contains("passes over one contour"));
}

/// Work objects on one fixture are named together, and what is decided differently over objects that stand is said to move apart.
#[test]
fn work_objects_on_one_fixture_are_named_together() {
    let (mut plan, listing, _) = example();
    let placement = |name: &str, applied: Placement, deviation_mm: f64| ObjectPlacement {
        work_object: name.to_owned(),
        applied,
        deviation_mm,
        sigma_mm: 0.2,
        probability_of_harm: 0.06,
        taught: false,
        unlocated: false,
        others: Vec::new(),
        held: false,
        remedy: None,
    };
    let mut fixture = placement("wobj0", Placement::Absolute, 2.131);
    fixture.others.push("wB".to_owned());
    plan.placements = vec![fixture.clone()];
    let text = sentences(&plan, &listing).join("\n");
    assert!(
        text.contains("work objects wobj0, wB (placed as one): shape and placement are corrected"),
        "{text}"
    );
    assert!(!text.contains("belong together"), "{text}");
    // Each has its entry in the JSON report.
    let [placements, _] = truegrind_report::placement::json(&plan, &listing);
    let names: Vec<_> = placements.as_array().unwrap().iter().map(|p| p["work_object"].clone()).collect();
    assert_eq!(names, ["wobj0", "wB"]);
    // Decided differently.
    plan.placements[0].others.clear();
    plan.placements.push(placement("wobj0", Placement::Shape, 1.5));
    let text = sentences(&plan, &listing).join("\n");
    assert!(text.contains("relative to each other by up to 2.131 mm"), "{text}");
    plan.placements[1].held = true;
    assert!(!sentences(&plan, &listing).join("\n").contains("belong together"));
}

/// Before and after stood side by side from different motions: the whole deviation of one object over the σ of the shape of another.
#[test]
fn before_and_after_are_stated_of_the_same_motions() {
    let target = |x: f64| format!("[[{x},0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]");
    let source = format!(
        "MODULE M\nPERS wobjdata wS:=[FALSE,TRUE,\"\",[[10,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\nPROC main()\n\
         MoveL {},v50,fine,tool0;\nMoveJ {},v50,fine,tool0\\WObj:=wS;\nMoveL {},v50,fine,tool0\\WObj:=wS;\nENDPROC\nENDMODULE\n",
        target(400.0),
        target(410.0),
        target(420.0)
    );
    let listing = Task::read(&[("m.mod", source.as_bytes())]).listing;
    let mut outcomes = vec![
        outcome(0, MotionStatus::Changed, None),
        outcome(1, MotionStatus::Changed, None),
        outcome(2, MotionStatus::Changed, None),
    ];
    // Over wobj0 all is corrected; over wS the shape alone, of which a joint motion has none.
    (outcomes[0].before_mm, outcomes[0].sigma_mm) = (1.2.into(), 0.558.into());
    (outcomes[1].before_mm, outcomes[1].sigma_mm) = (0.9.into(), 0.6.into());
    (outcomes[2].before_mm, outcomes[2].shape_sigma_mm) = (0.4.into(), 0.003.into());
    let placement = |name: &str, applied: Placement| ObjectPlacement {
        work_object: name.to_owned(),
        applied,
        deviation_mm: 1.0,
        sigma_mm: 0.5,
        probability_of_harm: 0.06,
        taught: false,
        unlocated: false,
        others: Vec::new(),
        held: false,
        remedy: None,
    };
    let placements = vec![placement("wobj0", Placement::Absolute), placement("wS", Placement::Shape)];
    let mut plan = Plan { outcomes, placements, ..Plan::default() };
    let files = [ProgramFile { file: "m.mod".to_owned(), output: None, unchanged: false }];
    let said = |plan: &Plan| terminal::document(&view::summary(plan, &listing, &files), 400);
    let text = said(&plan);
    assert!(
        text.contains(
            "corrected motions (shape and placement): 1.200 mm before; after correction a standard deviation (1σ) of at most 0.558 mm is expected"
        ),
        "{text}"
    );
    assert!(
        text.contains("corrected motions (shape only): 0.400 mm before; after correction a standard deviation (1σ) of at most 0.003 mm is expected"),
        "{text}"
    );
    // One kind alone.
    plan.placements[1].applied = Placement::Absolute;
    let text = said(&plan);
    assert!(text.contains("corrected motions: 1.200 mm before; after correction a standard deviation (1σ) of at most 0.600 mm is expected"), "{text}");
    assert!(!text.contains("besides"), "{text}");
    // A σ above the deviation is no harm by the correction: the uncorrected program has it too.
    plan.outcomes[1].sigma_mm = 1.5.into();
    let text = said(&plan);
    assert!(
        text.contains("of at most 1.500 mm is expected; uncorrected it has that uncertainty besides"),
        "{text}"
    );
}

/// A program that was corrected before states numbers that were never intended: nothing refers to them.
#[test]
fn a_program_that_is_corrected_again_states_no_before_and_after() {
    let (mut plan, mut listing, files) = example();
    plan.probability_of_harm = Some(0.006);
    let said =
        |plan: &Plan, listing: &Listing| terminal::document(&view::summary(plan, listing, &files), 400);
    let once = said(&plan, &listing);
    assert!(
        once.contains("(1σ) of at most") && once.contains("probability that the corrected cuts"),
        "{once}"
    );
    let mark = Mark { version: "0.1.0".to_owned(), model: "abc".to_owned(), partial: false };
    listing.marks = vec![Some(mark), None];
    let again = said(&plan, &listing);
    assert!(again.contains("[warning] Corrected a second time: both corrections add up"), "{again}");
    assert!(!again.contains("(1σ) of at most") && !again.contains("probability that"), "{again}");
}

/// The largest deviation of an uncorrected program is that of the motions with a known one.
#[test]
fn an_uncorrected_program_says_where_its_deviation_is_unknown() {
    let (mut plan, listing, files) = example();
    plan.outcomes.iter_mut().for_each(|outcome| outcome.status = MotionStatus::Left);
    let text = terminal::document(&view::summary(&plan, &listing, &files), 400);
    let expected = "the uncorrected program deviates by up to 1.500 mm; unknown at 1 motion";
    assert!(text.contains(expected), "{text}");
}
