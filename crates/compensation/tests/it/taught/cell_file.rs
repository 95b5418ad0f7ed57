//! What a cell file says of frames and tools, and what it may not say.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Joints;
use truegrind_compensation::cell::Cell;
use truegrind_compensation::cell::template::{TemplateProgram, cell_template};
use truegrind_compensation::deviation::MotionStatus;
use truegrind_compensation::frames::taught::contradictions;
use truegrind_compensation::frames::taught::taught_tcp;
use truegrind_compensation::options::Options;
use truegrind_compensation::plan::Plan;
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::plan::solved_program::plan;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::Reason;
use truegrind_programs::nc::setup::Setup;
use truegrind_programs::rapid::Task;
use truegrind_programs::reading::Language;
use truegrind_programs::rewrite::RewriteOptions;

use super::{
    RIGHT_MM, TARGETS, about, all_changed, degrees, faults, flange, joints, made_of, module, moves, object,
    planned, scene, stated, tool, translation,
};
use crate::{estimated, nominal, perturbed};

/// Numbers that no arm can hold are refused where they stand; what is worked out from them is never asked for.
#[test]
fn immense_numbers_are_refused_by_line() {
    for size in ["1E7", "1E20", "1E38", "1E308"] {
        let source = module(
            &format!("PERS tooldata t1:=[TRUE,[[0,0,{size}],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];\n"),
            &(moves("t1", "wobj0", &UnitQuaternion::identity())
                + &moves("tool0", "wobj0", &UnitQuaternion::identity()).replace("40,", &format!("{size},"))),
        );
        let (plan, _) = planned(&source, &Cell::default(), &perturbed(1, 1.0));
        // What does not fit into single precision has a reason of its own.
        let beyond =
            [Reason::BeyondReach, Reason::NumberRange].map(|reason| Some(OutcomeReason::Program(reason)));
        let refused = plan
            .outcomes
            .iter()
            .filter(|o| o.status == MotionStatus::Refused && beyond.contains(&o.reason()))
            .count();
        assert_eq!(refused, 5, "{size}: {:?}", plan.outcomes);
        let setup = Setup::default();
        let nc = format!(
            "; truegrind angles wpr\n; truegrind tool T1 t1 [[0,0,{size}],[1,0,0,0]]\nG90 G21 G54\nT1 M6\nG43.4 H1\nG1 X{size} \
             Y0. Z400. A180. B0. C0. F600.\n"
        );
        let task = truegrind_programs::nc::Task::read(&[("p.nc", nc.as_bytes())], &setup);
        let known = estimated(perturbed(1, 1.0), &[Joints::zeros()]);
        let plan = plan_of(&task.listing, &known);
        assert!(plan.changes.is_empty(), "{:?}", plan.outcomes);
        assert_eq!(task.listing.opaque.len(), 1, "the comment is listed: {:?}", task.listing.opaque);
    }
}

fn plan_of(
    listing: &truegrind_programs::motion::Listing,
    known: &truegrind_arm::estimated::Estimated,
) -> Plan {
    plan(listing, known, &Cell::default(), &Options::default())
}

/// Every key of a cell file is read: see [`truegrind_testing::keys`].
#[test]
fn every_key_of_a_cell_file_is_read() {
    let mut scene = scene(50);
    let tip = about(&scene.actual, &Point3::new(420.0, 60.0, 220.0), &scene.pointer);
    let told_tip = taught_tcp(&nominal().at_condition(&Condition::default()), &tip).unwrap();
    scene.told = made_of(&scene.touching, &told_tip);
    let data = tool("tPointer", &translation(&told_tip), true)
        + &tool("tGrind", &scene.grinder, true)
        + &object("wPart", [&scene.told, &scene.object[1]], false);
    let body =
        moves("tGrind", "wPart", &scene.turn()).replacen("[9E9,", "[10,", 1).replacen("[9E9,", "[20,", 1);
    let source = module(&data, &body);
    let q = scene.grinder.rotation.quaternion();
    let cell = format!(
        "[[tool]]\nname = \"tPointer\"\norigin = \"taught\"\nteaching_deg = {}\n[[tool]]\nname = \"tGrind\"\norigin = \
         \"metrology\"\nposition_mm = [3.0, -4.0, 95.0]\nquaternion_wxyz = [{}, {}, {}, {}]\n[[wobj]]\nname = \"wPart\"\norigin \
         = \"taught\"\ntaught_with = \"tPointer\"\nteaches = \"uframe\"\nteaching_deg = {}\n[[external]]\naxis = \
         \"a\"\ncarries = \"other\"\n",
        degrees(&tip, 6),
        q.w,
        q.i,
        q.j,
        q.k,
        degrees(&scene.touching, 6)
    );
    let seen = |text: &str| -> Result<String, String> {
        let cell = Cell::from_toml(text).map_err(|error| error.to_string())?;
        match faults(&source, &cell).as_slice() {
            [] => {
                let (plan, told) = planned(&source, &cell, &scene.actual);
                Ok(format!("{:?} {:?} {told:?}", plan.outcomes, plan.notes))
            }
            found => Err(found.join("; ")),
        }
    };
    assert_eq!(truegrind_testing::keys::unread(&cell, seen), Vec::<String>::new());
}

/// Keys that contradict each other, say nothing, or say twice.
#[test]
fn a_cell_file_that_contradicts_itself_is_refused() {
    let points = "[[0,10,10,0,30,0],[0,20,10,0,30,0],[10,20,10,0,30,0]]";
    for (text, part) in [
        (
            "[[tool]]\nname=\"t\"\norigin=\"metrology\"\n[[tool]]\nname=\"T\"\norigin=\"taught\"\n",
            "stated twice",
        ),
        (
            "[[tool]]\nname=\"T8\"\norigin=\"metrology\"\n[[tool]]\nname=\"T08\"\norigin=\"taught\"\n",
            "stated twice",
        ),
        (
            &format!("[[wobj]]\nname=\"w\"\norigin=\"metrology\"\nteaching_deg={points}\n"),
            "contradicts origin",
        ),
        ("[[wobj]]\nname=\"w\"\norigin=\"taught\"\ntaught_with=\"t\"\n", "taught_with has no effect"),
        ("[[wobj]]\nname=\"w\"\norigin=\"taught\"\nteaches=\"oframe\"\n", "teaches has no effect"),
        ("[[wobj]]\nname=\"w\"\norigin=\"metrology\"\nquaternion_wxyz=[1,0,0,0]\n", "without position_mm"),
        ("[[tool]]\nname=\"t\"\norigin=\"metrology\"\nposition_mm=[0,0,0.12]\n", "probably metres"),
        ("[[tool]]\nname=\"t\"\norigin=\"metrology\"\nposition_mm=[0,0,1e20]\n", "within 1,000,000 mm"),
        ("[[tool]]\nname=\"t\"\norigin=\"metrology\"\nposition_mm=[0,0,nan]\n", "within 1,000,000 mm"),
        (
            &format!(
                "[[wobj]]\nname=\"w\"\norigin=\"taught\"\nteaching_deg={}\n",
                points
                    .replace("10]]", "10],[0,1,2,3,4,5]]")
                    .replace("],[10,20,10,0,30,0]]", "],[10,20,10,0,30,0],[0,1,2,3,4,5]]")
            ),
            "expected exactly 3",
        ),
        (&format!("[[tool]]\nname=\"t\"\norigin=\"taught\"\nteaching_deg={points}\n"), "expected at least 4"),
        (
            "[[external]]\naxis=\"a\"\ncarries=\"base\"\n[[external]]\naxis=\"A\"\ncarries=\"other\"\n",
            "stated twice",
        ),
    ] {
        let error = Cell::from_toml(text).unwrap_err().to_string();
        assert!(error.contains(part), "{text}: {error}");
    }
    // What a surface file says of the same frame counts as much.
    let cell = stated("[[tool]]\nname=\"tSpindle\"\norigin=\"taught\"\n");
    let text = String::from_utf8_lossy(truegrind_surfaces::sample::BLADE.bytes).into_owned();
    let surface = truegrind_surfaces::sample::BLADE.read().unwrap();
    assert!(text.contains("tSpindle"));
    let taught = truegrind_surfaces::SurfaceFile {
        tool: truegrind_surfaces::Tool {
            origin: Some(truegrind_surfaces::Origin::Metrology),
            ..surface.tool.clone()
        },
        ..surface
    };
    let error = cell.with_surface(&taught).unwrap_err().to_string();
    assert!(error.contains("surface file") && error.contains("tSpindle"), "{error}");
}

/// NC programs name tools and work offsets by numbers: how comments call them counts as well, T08 is T8, and a comment that
/// says something else of the same number leaves it unknown.
#[test]
fn numbered_tools_and_offsets_are_found_by_number_and_by_name() {
    let scene = scene(60);
    let grinder = Pose::translation(3.0, -4.0, 95.0);
    let comment = |frame: &Pose| {
        let [position, quaternion] = [frame.translation.vector, frame.rotation.quaternion().imag()];
        let w = frame.rotation.w;
        format!(
            "[[{:.6},{:.6},{:.6}],[{w:.10},{:.10},{:.10},{:.10}]]",
            position.x, position.y, position.z, quaternion.x, quaternion.y, quaternion.z
        )
    };
    let source = format!(
        "%\nO0001\n(truegrind angles wpr)\n(truegrind tool T8 tGrind {})\n(truegrind frame G54 wPart {})\nG90 G21 G17 G54\nT8 M6\n\
         G43.4 H8\nG0 X10. Y-20. Z5. A180. B0. C0.\nG1 X40. Y10. Z5. F600.\nG1 X30. Y40. Z12.\nM30\n%\n",
        comment(&grinder),
        comment(&scene.told)
    );
    let mut known = estimated(scene.actual.clone(), &[Joints::zeros()]);
    (known.region.min_deg, known.region.max_deg) = ([-400.0; 6], [400.0; 6]);
    known.region.spacing_deg = 1e6;
    for [tool, object] in [["tGrind", "wPart"], ["T08", "g54"]] {
        let cell = stated(&format!(
            "[[tool]]\nname = \"{tool}\"\norigin = \"metrology\"\n[[tool]]\nname = \"T9\"\norigin = \"metrology\"\nposition_mm = \
             [-6, 2, 130]\n[[wobj]]\nname = \"{object}\"\norigin = \"taught\"\ntaught_with = \"T9\"\nteaching_deg = {}\n",
            degrees(&scene.touching, 4)
        ));
        let task = truegrind_programs::nc::Task::read(&[("p.nc", source.as_bytes())], &Setup::default());
        assert_eq!(contradictions(&task.listing, &cell, &nominal()), Vec::<String>::new());
        let plan = plan(&task.listing, &known, &cell, &Options::default());
        all_changed(&plan);
        let rewritten = task.rewrite(&plan.changes, &RewriteOptions::default()).unwrap();
        let text = rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
        let again = truegrind_programs::nc::Task::read(&[("p.nc", &text)], &Setup::default());
        for (motion, meant) in again.listing.motions.iter().zip(&TARGETS) {
            let told = motion.to().unwrap().value.unwrap().cartesian().unwrap().pose();
            let q = joints(&nominal(), &(scene.told * told * grinder.inverse()));
            let reached = scene.object[0].inverse() * flange(&scene.actual, &q) * grinder;
            let off = (reached.translation.vector - Vector3::from(*meant)).norm();
            assert!(off < RIGHT_MM, "{tool} {object}: {off} mm");
        }
    }
    // Both names of one tool, saying different things.
    let twice = stated(
        "[[tool]]\nname = \"T8\"\norigin = \"metrology\"\n[[tool]]\nname = \"tGrind\"\norigin = \"taught\"\n",
    );
    let task = truegrind_programs::nc::Task::read(&[("p.nc", source.as_bytes())], &Setup::default());
    let found = contradictions(&task.listing, &twice, &nominal());
    assert!(matches!(&found[..], [one] if one.contains("are both T8")), "{found:?}");
    let again = source.replace("G90", "(truegrind tool T08 tGrind [[0,0,99],[1,0,0,0]])\nG90");
    let task = truegrind_programs::nc::Task::read(&[("p.nc", again.as_bytes())], &Setup::default());
    assert_eq!(task.listing.opaque.len(), 1);
    assert!(
        task.listing.motions.iter().all(|m| m.reason() == Some(Reason::ToolUnknown)),
        "{:?}",
        task.listing.tools
    );
    // A statement that cannot be read is listed, and so is a convention that there is none of.
    for wrong in [
        "(truegrind angles wrp)",
        "(truegrind tool T8 [[0,0,99],[1,0,0,0]])",
        "(truegrind frame G54 w [[0,0],[1,0,0,0]])",
    ] {
        let text = format!("{wrong}\n{source}");
        let task = truegrind_programs::nc::Task::read(&[("p.nc", text.as_bytes())], &Setup::default());
        assert_eq!(task.listing.opaque.len(), 1, "{wrong}");
    }
}

/// The origin of a work object that a positioner moves was asked for, and changes nothing.
#[test]
fn a_template_does_not_ask_for_the_origin_of_a_work_object_that_an_axis_moves() {
    let source = "MODULE M
PERS wobjdata turning:=[FALSE,FALSE,\"STN1\",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
PERS wobjdata standing:=[FALSE,TRUE,\"\",[[400,0,300],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
PROC main()
MoveL [[0,0,10],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0\\WObj:=turning;
MoveL [[0,0,10],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0\\WObj:=standing;
ENDPROC
ENDMODULE
";
    let task = Task::read(&[("p.mod", source.as_bytes())]);
    let program = TemplateProgram { name: "p.mod", language: Language::Rapid, listing: &task.listing };
    let made = cell_template(&[program], None);
    assert_eq!(made.open, 1, "{}", made.text);
    assert!(made.text.contains("# work object turning: the work object is moved by an external axis"));
    assert!(made.text.contains("name = \"standing\""));
}
