//! Every key of every file is used, or it is an error.
//!
//! The class of fault: a key that is documented, read without complaint, and looked at by nobody (`taught_with` of a cell
//! file, `origin` of a surface file). Here each key of a complete sample is changed and taken away in turn, and something
//! that a user sees must change, or the file must be refused. A value that is one of a list of words is exchanged for the
//! others, so that a spelling mistake does not count as use.

use toml::{Table, Value};
use truegrind::arm::arm_file::ArmFile;
use truegrind::arm::estimated::Estimated;
use truegrind::arm::model::Joints;
use truegrind::calibration::measurement::simulation::recipe::Recipe;
use truegrind::compensation::cell::Cell;
use truegrind::compensation::compensate::compensate;
use truegrind::compensation::options::Options;
use truegrind::planning::toolpath::toolpath;
use truegrind::programs::rapid::{self, writer};
use truegrind::programs::reading::Program;
use truegrind::report::format::markdown;
use truegrind::report::robots as view;
use truegrind::surfaces::{SurfaceFile, sample};
use truegrind_testing::keys::unread;

#[test]
fn every_key_of_a_surface_file_is_read() {
    let sheet = truegrind::robots::load("abb-irb-120").unwrap().model;
    for shipped in sample::ALL {
        let seen = |text: &str| -> Result<String, String> {
            let read = SurfaceFile::read("s.toml", text.as_bytes(), |name| match name {
                "plate.stl" => Ok(sample::PLATE_STL.to_vec()),
                _ => Err("there is none"),
            });
            let file = read.map_err(|error| error.to_string())?;
            let path = toolpath(&file, &sheet, "abb-irb-120").map_err(|error| error.to_string())?;
            let program = writer::write(&path.draft).map_err(|error| error.to_string())?;
            let cell = Cell::default().with_surface(&file).map_err(|error| error.to_string())?;
            Ok(format!("{}{cell:?}", String::from_utf8_lossy(&program)))
        };
        // Coarser, so that it does not take long.
        let text = String::from_utf8_lossy(shipped.bytes).into_owned();
        let mut coarse: Table = text.parse().unwrap();
        for (frame, origin) in [("tool", "taught"), ("work_object", "metrology")] {
            coarse[frame]
                .as_table_mut()
                .unwrap()
                .insert("origin".to_owned(), Value::String(origin.to_owned()));
        }
        let path = coarse["path"].as_table_mut().unwrap();
        path.insert("max_step_mm".to_owned(), Value::Float(50.0));
        path.insert("lead_deg".to_owned(), Value::Float(2.0));
        if let Some(step) = path.get_mut("step_over_mm") {
            *step = Value::Float(25.0);
            // It bounds the step, and has no other use there.
            let mut narrow = coarse.clone();
            narrow["tool"].as_table_mut().unwrap().insert("radius_mm".to_owned(), Value::Float(12.0));
            let refused = seen(&toml::to_string(&narrow).unwrap()).unwrap_err();
            assert!(refused.contains("path.step_over_mm"), "{refused}");
            coarse["tool"].as_table_mut().unwrap().remove("radius_mm");
        } else {
            path.insert("scallop_mm".to_owned(), Value::Float(1.0));
        }
        let found = unread(&toml::to_string(&coarse).unwrap(), seen);
        assert_eq!(found, Vec::<String>::new(), "{}", shipped.file);
    }
}

#[test]
fn every_key_of_a_recipe_is_read() {
    let seen = |text: &str| -> Result<String, String> {
        let recipe = Recipe::parse(text, "r.toml").map_err(|error| error.to_string())?;
        let resolve = |name: &str| truegrind::robots::load(name).map(|r| r.model).map_err(|e| e.to_string());
        let simulation = recipe.simulate(resolve).map_err(|error| error.to_string())?;
        // `simulate` prints what it is about, and writes the arm.
        let arm = toml::to_string(&ArmFile::from(&simulation.actual)).unwrap();
        Ok(recipe.about + &simulation.csv + &arm)
    };
    for text in
        [include_str!("../data/irb120-cable.toml"), include_str!("../data/irb120-rounded.toml"), RECIPE]
    {
        let text = text.replace("count = 300", "count = 40");
        assert_eq!(unread(&text, seen), Vec::<String>::new());
    }
}

/// With what the shipped recipes do not have.
const RECIPE: &str = r#"
robot = "abb-irb-120"
seed = 4
readout = true
poses = { kind = "random", count = 12, repeats = 2, margin_deg = 10.0 }
[[arm.link]]
joint = 1
a_mm = 0.4
d_mm = 0.2
alpha_deg = 0.02
beta_deg = 0.03
theta_deg = 0.1
[[arm.effect]]
effect = "thermal-drift"
growth = 1e-4
time_constant_h = 0.7
growth_per_k = 1e-5
reference_c = 20.0
[circumstances]
hours = 3.0
temperature = { start_c = 20.0, end_c = 31.0, time_constant_h = 0.8 }
payload_kg = [1.0, 2.0]
[sensor]
kind = "pose"
frame = { position_mm = [900.0, 100.0, 300.0], wxyz = [0.8, 0.0, 0.0, 0.6] }
target = { position_mm = [10.0, 0.0, 30.0], wxyz = [0.6, 0.8, 0.0, 0.0] }
[noise]
sigma_mm = 0.02
per_metre_mm = 0.01
sigma_deg = 0.01
student_t = 4.0
[rounding]
readout_mm = 0.1
[[fault]]
fault = "readout-mismatch"
row_list = [3, 4]
shift_mm = [0.0, 2.0, 0.0]
[[fault]]
fault = "outliers"
row_list = [6]
size_mm = 5.0
"#;

#[test]
fn every_key_of_a_robot_file_is_read() {
    let all: Table = include_str!("../../crates/arm/src/robots/abb.toml").parse().unwrap();
    let one = &all["robot"][0];
    let text = toml::to_string(&Value::Table(Table::from_iter([(
        "robot".to_owned(),
        Value::Array(vec![one.clone()]),
    )])))
    .unwrap();
    let seen = |text: &str| -> Result<String, String> {
        let robot = truegrind::robots::parse(text, "r.toml").map_err(|error| error.to_string())?;
        Ok(format!("{}{:?}", markdown::document(&view::document(&robot)), robot.model))
    };
    assert_eq!(unread(&text, seen), Vec::<String>::new());
}

/// Models and tracks are read, kept and written again, by `track` at every look: what is kept is all that a reader of the
/// next model sees of where it came from, and what an arm is made of decides what programs become.
#[test]
fn every_key_of_a_model_is_kept_or_refused() {
    let seen = |text: &str| -> Result<String, String> {
        Estimated::from_toml(text).and_then(|arm| arm.to_toml()).map_err(|error| error.to_string())
    };
    let model =
        include_str!("../../fuzz/corpus/model/play.toml").replace("set_aside = []", "set_aside = [3]");
    assert_eq!(unread(&model, seen), Vec::<String>::new());
}

/// What the arms of a model are made of decides what a program becomes.
#[test]
fn every_key_of_the_arms_of_a_model_decides_what_programs_become() {
    let program = "MODULE m\nPROC main()\n\
        MoveJ [[350,-40,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n\
        MoveL [[350,60,380],[0.1,0,0.99498744,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z1,tool0;\n\
        MoveL [[300,90,390],[0.1,0,0.99498744,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n\
        ENDPROC\nENDMODULE\n";
    let whole: Table = include_str!("../../fuzz/corpus/model/play.toml").parse().unwrap();
    let task = Program::Rapid(rapid::Task::read(&[("m.mod", program.as_bytes())]));
    for part in ["nominal", "estimated"] {
        let seen = |text: &str| -> Result<String, String> {
            let mut model = whole.clone();
            model.insert(part.to_owned(), Value::Table(text.parse().unwrap()));
            let arm =
                Estimated::from_toml(&toml::to_string(&model).unwrap()).map_err(|error| error.to_string())?;
            let options = Options { condition: arm.condition, ..Options::default() };
            let done =
                compensate(&task, &arm, &Cell::default(), &options, None).map_err(|e| e.to_string())?;
            let joints = Joints::from([0.3, 0.2, -0.3, 0.4, 0.6, -0.5]);
            let fast = (&arm.model.limits, &arm.nominal.limits, &arm.model.bodies, &arm.nominal.bodies);
            Ok(format!("{:?}{:?}{fast:?}", done.plan, arm.nominal.forward(&joints, &arm.condition)))
        };
        let found = unread(&toml::to_string(&whole[part]).unwrap(), seen);
        assert_eq!(found, Vec::<String>::new(), "{part}");
    }
}
