//! The condition of the arm: payloads that programs state, its warmth, and what a judgement of programs rests on.

use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::lumped_compliance::{Lump, LumpedCompliance};
use truegrind_arm::effect::thermal::Thermal;
use truegrind_arm::estimated::Estimated;
use truegrind_compensation::cell::Cell;
use truegrind_compensation::compensate::compensate;
use truegrind_compensation::condition::other_load::is_other_load;
use truegrind_compensation::condition::overload::stated_overload;
use truegrind_compensation::condition::payload::payload_at;
use truegrind_compensation::condition::warmth::growth_per_k;
use truegrind_compensation::deviation::{After, PathReport};
use truegrind_compensation::options::Options;
use truegrind_compensation::verify::{ActingArm, VerificationTask, verify};
use truegrind_programs::motion::Listing;
use truegrind_programs::motion::load::{Grip, Load, Loads};
use truegrind_programs::nc;
use truegrind_programs::nc::setup::Setup;
use truegrind_programs::rapid::Task;
use truegrind_programs::reading::Program;

const HEAD: &str = "MODULE M\n PERS tooldata t := [TRUE,[[0,0,100],[1,0,0,0]],[2,[0,0,50],[1,0,0,0],0,0,0]];\n \
                    PERS loaddata part := [3,[0,0,20],[1,0,0,0],0,0,0];\n VAR loaddata weighed;\n";

/// The grips at each motion of a program whose moves are written `m;`.
fn grips(body: &str) -> (Task<'static>, Loads) {
    let target = "[[400,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
    let body = body.replace("m;", &format!("MoveL {target},v100,fine,t;")).replace("TARGET", target);
    let text: &'static str = Box::leak(format!("{HEAD}{body}ENDMODULE\n").into_boxed_str());
    let task = Task::read(&[("p.mod", text.as_bytes())]);
    let loads = task.loads();
    (task, loads)
}

fn masses(body: &str) -> Vec<Option<f64>> {
    let (task, loads) = grips(body);
    let listing = &task.listing;
    (0..listing.motions.len())
        .map(|k| payload_at(&loads, k, &listing.motions[k], listing).map(|load: Load| load.mass_kg))
        .collect()
}

#[test]
fn a_grip_is_followed_through_statements_branches_loops_and_calls() {
    let tool = Some(2.0);
    let both = Some(5.0);
    assert_eq!(masses("PROC main()\n m;\n m;\nENDPROC\n"), [tool, tool]);
    assert_eq!(
        masses("PROC main()\n m;\n GripLoad part;\n m;\n GripLoad load0;\n m;\nENDPROC\n"),
        [tool, both, tool]
    );
    // Both branches grip it: known afterwards; one does: unknown, and only the load of the tool is used.
    let body = "PROC main()\n IF a THEN\n GripLoad part;\n ELSE\n GripLoad part;\n ENDIF\n m;\nENDPROC\n";
    assert_eq!(masses(body), [both]);
    let (_, loads) = grips("PROC main()\n IF a THEN\n GripLoad part;\n ENDIF\n m;\nENDPROC\n");
    assert_eq!((loads.grips.as_slice(), loads.unknown()), (&[Grip::Unknown][..], 1));
    // At the start of a loop the part may be held from the previous iteration.
    let (_, loads) =
        grips("PROC main()\n FOR i FROM 1 TO 2 DO\n m;\n GripLoad part;\n m;\n ENDFOR\n m;\nENDPROC\n");
    assert!(matches!(loads.grips[..], [Grip::Unknown, Grip::Holds(_), Grip::Unknown]), "{:?}", loads.grips);
    // Through routines, whichever comes first in the file.
    let body = "PROC main()\n m;\n take;\n m;\n place;\n m;\nENDPROC\nPROC take()\n GripLoad part;\nENDPROC\n\
                PROC place()\n m;\n GripLoad load0;\nENDPROC\n";
    assert_eq!(masses(body), [tool, both, tool, both]);
    // A load that the program measures is not in the text.
    let (_, loads) = grips("PROC main()\n GripLoad weighed;\n m;\nENDPROC\n");
    assert_eq!(loads.unknown(), 1);
}

#[test]
fn loads_add_up_at_their_common_centre_and_tload_stands_for_both() {
    let (task, loads) = grips("PROC main()\n GripLoad part;\n m;\nENDPROC\n");
    let listing = &task.listing;
    let load = payload_at(&loads, 0, &listing.motions[0], listing).unwrap();
    // 2 kg at 50 mm and 3 kg at 20 mm beyond the TCP at 100 mm.
    assert!((load.centre_mm[2] - (2.0 * 50.0 + 3.0 * 120.0) / 5.0).abs() < 1e-9, "{load:?}");
    let body = "PROC main()\n GripLoad part;\n MoveL TARGET,v100,fine,t\\TLoad:=part;\n \
                MoveL TARGET,v100,fine,t\\TLoad:=load0;\nENDPROC\n";
    assert_eq!(masses(body), [Some(3.0), Some(5.0)]);
    // A tool without a stated mass says nothing.
    let text = "MODULE M\n PERS tooldata u := [TRUE,[[0,0,1],[1,0,0,0]],[-1,[0,0,0],[1,0,0,0],0,0,0]];\n PROC main()\n \
                MoveL [[400,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,u;\n ENDPROC\nENDMODULE\n";
    let task = Task::read(&[("p.mod", text.as_bytes())]);
    assert_eq!(payload_at(&Loads::default(), 0, &task.listing.motions[0], &task.listing), None);
}

#[test]
fn a_grip_changes_in_functions_by_names_in_traps_and_from_cycle_to_cycle() {
    let unknown = |body: &str| grips(body).1.unknown();
    let take = "PROC take1()\n GripLoad part;\nENDPROC\nFUNC bool took()\n take1;\n RETURN TRUE;\nENDFUNC\n";
    let none = "PROC take1()\nENDPROC\nFUNC bool took()\n take1;\n RETURN TRUE;\nENDFUNC\n";
    for body in [
        "IF took() THEN\n ENDIF\n m;\n",
        "IF took() m;\n",
        "b := took();\n m;\n",
        "WHILE took() DO\n ENDWHILE\n m;\n",
        "CallByVar \"take\",1;\n m;\n",
        "MoveLSync TARGET,v100,z10,t,\"take1\";\n m;\n",
        "%\"take1\"%;\n m;\n",
    ] {
        // Nothing is held again when the next cycle begins.
        let main = format!("PROC main()\n{body} GripLoad load0;\nENDPROC\n");
        let motions = body.matches("m;").count() + body.matches("TARGET").count();
        assert_eq!(unknown(&format!("{main}{take}")), motions, "{body}");
        if !body.contains('%') {
            assert_eq!(unknown(&format!("{main}{none}")), 0, "{body}");
        }
    }
    let trap = "TRAP tr\n GripLoad part;\nENDTRAP\n";
    assert_eq!(unknown(&format!("PROC main()\n m;\nENDPROC\n{trap}")), 1);
    // The load at the end of main is held at its next start.
    assert_eq!(unknown("PROC main()\n m;\n GripLoad part;\n m;\nENDPROC\n"), 1);
    // load0 means no load, whatever the tool weighs.
    let (_, loads) = grips("PROC main()\n GripLoad load0;\n m;\nENDPROC\n");
    assert_eq!(loads.grips, [Grip::Empty]);
    let load0 = "PROC main()\n MoveL TARGET,v100,fine,t\\TLoad:=load0;\nENDPROC\n";
    assert_eq!(masses(load0), [Some(2.0)]);
}

/// The class of fault: a call by which a routine begins with another gripped load than by the calls that name it.
#[test]
fn what_a_computed_name_or_an_interrupt_begins_with_is_not_known() {
    let body = "PROC main()\n %\"go\"%;\n GripLoad part;\n go;\nENDPROC\nPROC go()\n m;\nENDPROC\n";
    let (_, loads) = grips(body);
    assert_eq!((loads.grips.as_slice(), loads.unknown()), (&[Grip::Unknown][..], 1));
    let direct = body.replace(" %\"go\"%;\n", "");
    assert_eq!(masses(&direct), [Some(5.0)]);
    let late = body.replace("%\"go\"%", "CallByVar \"g\",1");
    let (_, loads) = grips(&late.replace("go", "g1"));
    assert_eq!(loads.unknown(), 1, "{:?}", loads.grips);
}

/// The class: a mass in another unit. Tool and load together count, and \TLoad.
#[test]
fn masses_above_the_rated_payload_are_told_with_the_unit_that_fits() {
    let told = |body: &str, robot: &str| {
        let (task, loads) = grips(body);
        stated_overload(&task.listing, &loads, robot).map(|stated| stated.note)
    };
    let both = "PROC main()\n m;\n GripLoad part;\n m;\n GripLoad load0;\n m;\nENDPROC\n";
    let note = told(both, "abb-irb-120").unwrap();
    assert!(note.contains("up to 5 kg") && note.contains("(line 8)"), "{note}");
    assert!(
        note.contains("abb-irb-120 is rated for 3 kg") && note.contains("in pounds it would be 2.268 kg"),
        "{note}"
    );
    assert_eq!(told(both, "kuka-kr6-r900-sixx"), None);
    assert_eq!(told(both, "an-arm-of-my-own"), None);
    assert_eq!(told("PROC main()\n m;\nENDPROC\n", "abb-irb-120"), None);
    let grams = both.replace("GripLoad part", "GripLoad [1500,[0,0,20],[1,0,0,0],0,0,0]");
    let note = told(&grams, "abb-irb-120");
    assert!(note.is_none_or(|note| note.contains("in grams it would be 1.502 kg")));
}

/// 25 kg on an arm for 3 kg was "ok", with a note.
#[test]
fn a_mass_far_above_the_rating_is_a_warning() {
    let arm = super::estimated(super::perturbed(3, 1.0), &[truegrind_arm::model::Joints::zeros()]);
    let is_overloaded = |kg: f64, payload_kg: Option<f64>| {
        let (task, loads) =
            grips(&format!("PROC main()\n GripLoad [{kg},[0,0,20],[1,0,0,0],0,0,0];\n m;\nENDPROC\n"));
        let mut options = Options { loads: payload_kg.is_none().then_some(loads), ..Options::default() };
        options.condition.payload_kg = payload_kg;
        let program = Program::Rapid(task);
        compensate(&program, &arm, &Cell::default(), &options, None).unwrap().plan.is_overloaded
    };
    // The tool weighs 2 kg.
    assert_eq!([1.0, 2.0, 23.0].map(|kg| is_overloaded(kg, None)), [false, false, true]);
    assert_eq!([3.0, 4.0, 25.0].map(|kg| is_overloaded(1.0, Some(kg))), [false, false, true]);
}

/// A deflection that was identified without the masses of the arm follows no load: a tool of 60 kg on an arm measured without one was "ok".
#[test]
fn a_load_that_the_deflection_does_not_follow_is_counted() {
    let mut arm = super::estimated(super::perturbed(3, 1.0), &[truegrind_arm::model::Joints::zeros()]);
    let other = |arm: &truegrind_arm::estimated::Estimated, grip: &str| {
        let (task, loads) = grips(&format!("PROC main()\n {grip}\n m;\nENDPROC\n"));
        let options = Options { loads: Some(loads), ..Options::default() };
        compensate(&Program::Rapid(task), arm, &Cell::default(), &options, None).unwrap().plan.other_loads
    };
    assert_eq!(other(&arm, ""), 0, "a stiff arm");
    let lump = Lump { frame: 3, axis: None, moment: None, factor: 1e-7 };
    arm.model.effects.push(Effect::LumpedCompliance(LumpedCompliance { joint: 1, lump: vec![lump] }));
    assert_eq!(other(&arm, "GripLoad part;"), 0, "less than is stated anyway");
    arm.model.effects.clear();
    let lump = Lump { factor: 1e-2, ..lump };
    arm.model.effects.push(Effect::LumpedCompliance(LumpedCompliance { joint: 1, lump: vec![lump] }));
    // The tool weighs 2 kg.
    assert_eq!([other(&arm, ""), other(&arm, "GripLoad part;")], [1, 1]);
    arm.condition.payload_kg = Some(2.0);
    assert_eq!([other(&arm, ""), other(&arm, "GripLoad part;")], [0, 1]);
    assert!(!is_other_load(2.1, &arm) && is_other_load(0.0, &arm));
}

/// The deviations of a program that an estimated arm runs as its data sheet says.
fn judged(arm: &Estimated, listing: &Listing, loads: Option<&Loads>) -> PathReport {
    let task = VerificationTask {
        original: listing,
        rewritten: None,
        cell: &Cell::default(),
        surface: None,
        program: "p",
        name: "test",
        after: After::PredictedRemainder,
        tolerance_mm: 0.05,
        loads: [loads, loads],
    };
    let nominal = super::nominal();
    let acting =
        ActingArm { nominal: &nominal, model: &arm.model, knowledge: Some(arm), condition: arm.condition };
    verify(&task, &acting)
}

/// `deviation` gave no warning of such a load, and none of a tool vector without a turn.
#[test]
fn what_the_judged_deviations_rest_on_is_told() {
    let mut arm = super::estimated(super::perturbed(3, 1.0), &[truegrind_arm::model::Joints::zeros()]);
    let lump = Lump { frame: 3, axis: None, moment: None, factor: 1e-2 };
    arm.model.effects.push(Effect::LumpedCompliance(LumpedCompliance { joint: 1, lump: vec![lump] }));
    let assumptions =
        |arm: &Estimated, listing: &Listing, loads: Option<&Loads>| judged(arm, listing, loads).assumptions;
    let (task, loads) = grips("PROC main()\n m;\n m;\nENDPROC\n");
    let told = assumptions(&arm, &task.listing, Some(&loads));
    assert!(told.len() == 1 && told[0].starts_with("2 motions carry another load"), "{told:?}");
    arm.condition.payload_kg = Some(2.0);
    assert!(assumptions(&arm, &task.listing, Some(&loads)).is_empty());
    let text = "; truegrind tool T1 t [[0,0,50],[1,0,0,0]]\n; truegrind frame G54 w [[400,0,250],[1,0,0,0]]\n\
                N1 G90 G71 G17 G54\nN2 T1 D1 M6\nN3 TRAORI\nG1 X0 Y0 Z20 A3=0 B3=0 C3=1 F600\nX10\nM30\n";
    let task = nc::Task::read(&[("p.mpf", text.as_bytes())], &Setup::default());
    let told = assumptions(&arm, &task.listing, None);
    assert!(told.len() == 1 && told[0].contains("turn about the tool vector"), "{told:?}");
}

/// The orientation of the tool was stated as 0.000° after a correction, however little was known of it.
#[test]
fn the_turn_of_a_tool_has_a_standard_deviation() {
    let (task, _) = grips("PROC main()\n m;\nENDPROC\n");
    let mut arm = super::estimated(super::perturbed(3, 1.0), &[truegrind_arm::model::Joints::zeros()]);
    let turn_sigma_rad = |arm: &Estimated| judged(arm, &task.listing, None).turn_sigma_rad.unwrap();
    arm.covariance.fill(0.0);
    assert_eq!(turn_sigma_rad(&arm), 0.0);
    // The zeros of joints 5 and 6, whose axes are perpendicular.
    for (name, sigma) in [("link5.theta", 3e-3), ("link6.theta", 4e-3), ("link2.a", 1.0)] {
        let at = arm.order.iter().position(|parameter| parameter.to_string() == name).unwrap();
        arm.covariance[(at, at)] = f64::powi(sigma, 2);
    }
    assert!((turn_sigma_rad(&arm) - 5e-3).abs() < 2e-5, "{}", turn_sigma_rad(&arm));
}

/// For which warmth a program is corrected was not said.
#[test]
fn the_assumed_warmth_is_told() {
    let mut arm = super::estimated(super::perturbed(3, 1.0), &[truegrind_arm::model::Joints::zeros()]);
    let notes = |arm: &Estimated, condition: Condition| {
        let (task, _) = grips("PROC main()\n m;\nENDPROC\n");
        let options = Options { condition, ..Options::default() };
        let notes =
            compensate(&Program::Rapid(task), arm, &Cell::default(), &options, None).unwrap().plan.notes;
        notes.into_iter().filter(|note| note.contains("no σ counts")).collect::<Vec<_>>()
    };
    let at = Condition { time_h: Some(2.0), temperature_c: Some(31.5), ..Condition::default() };
    assert!(notes(&arm, at).is_empty());
    let thermal =
        Thermal { growth: 0.0, time_constant_h: 1.0, start_h: 0.0, growth_per_k: 1.2e-5, reference_c: 20.0 };
    arm.model.effects.push(Effect::ThermalDrift(thermal.clone()));
    assert_eq!(growth_per_k(&arm), Some(1.2e-5));
    let told = notes(&arm, at);
    assert!(told.len() == 1 && told[0].contains("31.5 °C") && told[0].contains("0.120 mm"), "{told:?}");
    arm.model.effects[0] = Effect::ThermalDrift(Thermal { growth: 2e-4, growth_per_k: 0.0, ..thermal });
    assert_eq!(growth_per_k(&arm), None);
    let told = notes(&arm, at);
    assert!(told.len() == 1 && told[0].contains("173 µm per metre"), "{told:?}");
}
