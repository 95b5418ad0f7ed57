//! Random RAPID programs: what people and posts write, with the constructs in which the value of a target hides.

mod layout;
mod routines;
mod statements;
mod taught;

use std::fmt::Write;

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::check::Features;
use crate::arm::{Arm, Configuration, Pose};
use crate::model::Case;
use crate::under_test::Options;

/// A program with what belongs to it.
#[derive(Debug, Clone)]
pub struct Made {
    /// Files by name.
    pub files: Vec<(String, Vec<u8>)>,
    /// The cell file.
    pub cell: String,
    /// What is asked of the correction.
    pub options: Options,
    /// How often main runs.
    pub cycles: usize,
    /// Tools that stand otherwise than told.
    pub real_tools: Vec<(String, Pose)>,
    /// Objects that stand otherwise than told: user frame, object frame.
    pub real_objects: Vec<(String, Pose, Pose)>,
}

/// A tool of the program.
#[derive(Debug, Clone)]
struct Tool {
    name: &'static str,
    held: bool,
    frame: Pose,
    load: Option<(f64, [f64; 3])>,
}

/// A work object of the program.
#[derive(Debug, Clone)]
struct Object {
    name: &'static str,
    held: bool,
    user: Pose,
    object: Pose,
}

/// A tool with the object in which it works.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pair {
    tool: usize,
    object: usize,
}

/// A target that is declared.
#[derive(Debug, Clone)]
struct Named {
    /// As a motion names it: `p10`, `pa{2}`, `job1.at`.
    name: String,
    pair: Pair,
    /// Whether the program may write to it.
    writable: bool,
}

/// What a program is made from.
struct Maker<'a> {
    rng: &'a mut ChaCha8Rng,
    arm: &'a Arm,
    base: [f64; 6],
    spread: f64,
    tools: Vec<Tool>,
    objects: Vec<Object>,
    pairs: Vec<Pair>,
    targets: Vec<Named>,
    joints: Vec<String>,
    decimals: [usize; 2],
    features: Features,
    /// How many labels there are.
    labels: usize,
    /// Names of loops that run.
    loops: usize,
    /// Whether the routines are in a file of their own.
    apart: bool,
}

/// Makes a program. `taught`: with a tool or an object that was taught.
pub fn program(rng: &mut ChaCha8Rng, case: &Case, features: Features, taught: bool) -> Made {
    let (base, spread) = base(rng, &case.arm, features.borders && !taught);
    let decimals = [rng.random_range(1..6), rng.random_range(6..10)];
    let mut maker = Maker {
        rng,
        arm: &case.arm,
        base,
        spread,
        tools: Vec::new(),
        objects: Vec::new(),
        pairs: Vec::new(),
        targets: Vec::new(),
        joints: Vec::new(),
        decimals,
        features,
        labels: 0,
        loops: 0,
        apart: false,
    };
    maker.cell();
    let mut made = Made {
        files: Vec::new(),
        cell: String::new(),
        options: maker.options(),
        cycles: 1 + usize::from(maker.chance(0.2)),
        real_tools: Vec::new(),
        real_objects: Vec::new(),
    };
    if taught {
        maker.teach(&mut made);
    }
    maker.write(&mut made);
    made
}

/// Joints around which the program moves, and how far it goes from there (share of the usual).
fn base(rng: &mut ChaCha8Rng, arm: &Arm, borders: bool) -> ([f64; 6], f64) {
    let mut quarter =
        |low: i32, high: i32| 90.0 * f64::from(rng.random_range(low..=high)) + rng.random_range(25.0..65.0);
    let (q1, q4, q6) = (quarter(-1, 0), quarter(-1, 0), quarter(-2, 1));
    let q5 = rng.random_range(35.0..85.0) * if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let mut deg = [q1, rng.random_range(-15.0..35.0), rng.random_range(-25.0..15.0), q4, q5, q6];
    let border = borders && rng.random_bool(0.3);
    let spread = if border { 0.4 } else { 1.0 };
    let kind = if border { rng.random_range(0..5) } else { 5 };
    match kind {
        0 => deg[4] = rng.random_range(-4.0..4.0),
        1 => deg[2] = -(270.0f64 / 3.5) + rng.random_range(-4.0..4.0),
        _ => {}
    }
    let mut deg = arm.map.counted(&deg);
    match kind {
        2 => deg[rng.random_range(0..6)] += 90.0,
        3 => {
            let joint = rng.random_range(0..5);
            let (low, high) = (arm.min[joint].to_degrees(), arm.max[joint].to_degrees());
            let inside = rng.random_range(0.0..4.0);
            deg[joint] = if rng.random_bool(0.5) { low + inside } else { high - inside };
        }
        4 => {
            // A quarter of axis 1, 4 or 6 ends here.
            let joint = [0, 3, 5][rng.random_range(0..3)];
            deg[joint] = 90.0 * (deg[joint] / 90.0).floor() + rng.random_range(-2.0..2.0);
        }
        _ => {}
    }
    let clamp = |j: usize| deg[j].to_radians().clamp(arm.min[j] + 0.01, arm.max[j] - 0.01);
    (std::array::from_fn(clamp), spread)
}

impl Maker<'_> {
    fn chance(&mut self, share: f64) -> bool {
        self.rng.random_bool(share)
    }

    fn pick<'t>(&mut self, list: &[&'t str]) -> &'t str {
        list[self.rng.random_range(0..list.len())]
    }

    fn options(&mut self) -> Options {
        Options {
            tolerance_mm: if self.chance(0.6) { 0.05 } else { 20.0 },
            joint_targets: self.chance(0.1),
            emit_joints: self.chance(0.08),
            segments: self.chance(0.1),
            payload: None,
        }
    }

    fn small_turn(&mut self, most_deg: f64) -> UnitQuaternion<f64> {
        let mut angle = || self.rng.random_range(-most_deg..most_deg).to_radians();
        UnitQuaternion::from_scaled_axis(Vector3::new(angle(), angle(), angle()))
    }

    fn place(&mut self, middle: [f64; 3], most: f64) -> Translation3<f64> {
        let v: [f64; 3] = middle.map(|m| ((m + self.rng.random_range(-most..most)) * 10.0).round() / 10.0);
        Translation3::new(v[0], v[1], v[2])
    }

    /// A pose as it reads once it is written.
    fn rounded(&self, pose: &Pose, decimals: [usize; 2]) -> Pose {
        let at = |v: f64, n: usize| format!("{v:.n$}").parse::<f64>().unwrap_or(v);
        let t = pose.translation.vector.map(|v| at(v, decimals[0]));
        let q = pose.rotation.quaternion();
        let q = nalgebra::Quaternion::new(
            at(q.w, decimals[1]),
            at(q.i, decimals[1]),
            at(q.j, decimals[1]),
            at(q.k, decimals[1]),
        );
        Pose::from_parts(Translation3::from(t), UnitQuaternion::from_quaternion(q))
    }

    /// Tools and objects.
    fn cell(&mut self) {
        let frame = |maker: &mut Self, z: f64| {
            let turn = if maker.chance(0.5) { UnitQuaternion::identity() } else { maker.small_turn(20.0) };
            let pose = Pose::from_parts(maker.place([0.0, 0.0, z], 15.0), turn);
            maker.rounded(&pose, [3, 8])
        };
        let (a, b) = (frame(self, 90.0), frame(self, 110.0));
        let tool = |name, frame, load| Tool { name, held: true, frame, load };
        self.tools = vec![
            tool("tool0", Pose::identity(), None),
            tool("tGrind", a, Some((1.25, [3.0, 0.0, 55.0]))),
            tool("tSmall", b, None),
        ];
        let user = frame(self, 200.0);
        let object = frame(self, 0.0);
        let room = frame(self, 150.0);
        let unit = Pose::identity();
        self.objects = vec![
            Object { name: "wobj0", held: false, user: unit, object: unit },
            Object { name: "wPart", held: false, user, object },
            Object { name: "wRoom", held: false, user: unit, object: room },
        ];
        for (tool, object) in [(0, 0), (1, 0), (1, 1), (2, 2), (2, 1)] {
            self.pairs.push(Pair { tool, object });
        }
        if self.chance(0.1) {
            // The tool stands in the room, the robot holds the part.
            let at = self.arm.nominal_forward(&self.base);
            let frame = self.rounded(&(at * Translation3::new(0.0, 0.0, 100.0)), [3, 8]);
            self.tools.push(Tool { name: "tStand", held: false, frame, load: None });
            let held = Pose::from_parts(self.place([0.0, 0.0, 60.0], 10.0), self.small_turn(10.0));
            let held = self.rounded(&held, [3, 8]);
            self.objects.push(Object { name: "wHeld", held: true, user: held, object: unit });
            self.pairs.push(Pair { tool: 3, object: 3 });
        }
    }

    /// Joints near the base.
    fn near(&mut self) -> [f64; 6] {
        let most = [8.0, 6.0, 6.0, 10.0, 10.0, 10.0];
        std::array::from_fn(|j| {
            let moved = self.rng.random_range(-1.0..1.0f64) * most[j] * self.spread;
            (self.base[j] + moved.to_radians()).clamp(self.arm.min[j] + 1e-4, self.arm.max[j] - 1e-4)
        })
    }

    /// Where a target stands in its object.
    fn in_object(&self, q: &[f64; 6], pair: Pair) -> Pose {
        let (tool, object) = (&self.tools[pair.tool], &self.objects[pair.object]);
        let flange = self.arm.nominal_forward(q);
        let place = object.user * object.object;
        if tool.held {
            place.inverse() * flange * tool.frame
        } else {
            place.inverse() * flange.inverse() * tool.frame
        }
    }

    fn number(&mut self, v: f64, decimals: usize) -> String {
        let text = format!("{v:.decimals$}");
        let text = if text.trim_start_matches(['-', '0', '.']).is_empty() {
            text.trim_start_matches('-').to_owned()
        } else {
            text
        };
        match self.rng.random_range(0..12) {
            0 if text.contains('.') => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
            1 if text.starts_with("0.") => text[1..].to_owned(),
            2 if text.starts_with('-') => format!("- {}", &text[1..]),
            _ => text,
        }
    }

    fn pos(&mut self, v: &Vector3<f64>, decimals: usize) -> String {
        let [x, y, z] = [v.x, v.y, v.z].map(|v| self.number(v, decimals));
        format!("[{x},{y},{z}]")
    }

    fn orient(&mut self, q: &UnitQuaternion<f64>, decimals: usize) -> String {
        let [w, x, y, z] = [q.w, q.i, q.j, q.k].map(|v| self.number(v, decimals));
        format!("[{w},{x},{y},{z}]")
    }

    fn pose(&mut self, pose: &Pose, decimals: [usize; 2]) -> String {
        let pos = self.pos(&pose.translation.vector, decimals[0]);
        format!("[{pos},{}]", self.orient(&pose.rotation, decimals[1]))
    }

    /// A robtarget.
    fn target(&mut self, pair: Pair) -> String {
        let q = self.near();
        let conf = self.arm.configuration(&q);
        let pose = self.in_object(&q, pair);
        self.target_of(&pose, conf)
    }

    fn target_of(&mut self, pose: &Pose, conf: Configuration) -> String {
        let decimals = self.decimals;
        let pos = self.pos(&pose.translation.vector, decimals[0]);
        let rot = self.orient(&pose.rotation, decimals[1]);
        let [a, b, c, d] = conf;
        let none = self.pick(&["9E9", "9E+09", "9e9"]);
        format!("[{pos},{rot},[{a},{b},{c},{d}],[{}]]", [none; 6].join(","))
    }

    fn pair(&mut self) -> Pair {
        self.pairs[self.rng.random_range(0..self.pairs.len())]
    }

    fn jointtarget(&mut self) -> String {
        let q = self.near();
        let list: Vec<String> = q.iter().map(|q| format!("{:.4}", q.to_degrees())).collect();
        format!("[[{}],[9E9,9E9,9E9,9E9,9E9,9E9]]", list.join(","))
    }

    /// Declarations of the module.
    fn data(&mut self) -> String {
        let mut out = String::new();
        for index in 1..self.tools.len() {
            let Tool { name, held, frame, load } = self.tools[index].clone();
            let frame = self.pose(&frame, [6, 9]);
            let (kg, [x, y, z]) = load.unwrap_or((0.5, [0.0, 0.0, 30.0]));
            let held = if held { "TRUE" } else { "FALSE" };
            let _ =
                writeln!(out, "PERS tooldata {name}:=[{held},{frame},[{kg},[{x},{y},{z}],[1,0,0,0],0,0,0]];");
        }
        for index in 1..self.objects.len() {
            let Object { name, held, user, object } = self.objects[index].clone();
            let user = self.pose(&user, [6, 9]);
            let object = self.pose(&object, [6, 9]);
            let held = if held { "TRUE" } else { "FALSE" };
            let _ = writeln!(out, "PERS wobjdata {name}:=[{held},TRUE,\"\",{user},{object}];");
        }
        out.push_str("VAR num n1:=1;\nVAR num n2:=0;\nVAR num n3;\nPERS num np:=2;\nVAR bool b1:=FALSE;\n");
        out.push_str("VAR string s1:=\"go ! \"\"x\"\" \\\\ MoveL\";\nCONST num gap:=4.5;\nCONST num lifts{3}:=[3,-2,7];\n");
        out.push_str("PERS loaddata ldPart:=[0.8,[0,5,20],[1,0,0,0],0,0,0];\nVAR intnum int1;\n");
        let shift = Pose::from_parts(self.place([0.0; 3], 12.0), UnitQuaternion::identity());
        let turned = Pose::from_parts(self.place([0.0; 3], 6.0), self.small_turn(3.0));
        let _ = writeln!(out, "CONST pose shift1:={};", self.pose(&shift, [3, 6]));
        let _ = writeln!(out, "VAR pose shift2:={};", self.pose(&turned, [3, 9]));
        self.declared_targets(&mut out);
        for index in 1..3 {
            let name = format!("j{index}0");
            let _ = writeln!(out, "CONST jointtarget {name}:={};", self.jointtarget());
            self.joints.push(name);
        }
        out
    }

    fn declared_targets(&mut self, out: &mut String) {
        for index in 1..=5 {
            let pair = self.pair();
            let name = format!("p{index}0");
            let kind = self.pick(&["CONST", "CONST", "PERS", "LOCAL CONST", "VAR"]);
            let value = self.target(pair);
            let _ = writeln!(out, "{kind} robtarget {name}:={value};");
            self.targets.push(Named { name, pair, writable: !kind.ends_with("CONST") });
        }
        for name in ["pv1", "pv2"] {
            let pair = self.pair();
            let value = self.target(pair);
            let _ = writeln!(out, "VAR robtarget {name}:={value};");
            self.targets.push(Named { name: name.into(), pair, writable: true });
        }
        let pair = self.pair();
        let list: Vec<String> = (0..3).map(|_| self.target(pair)).collect();
        let kind = self.pick(&["CONST", "VAR", "PERS"]);
        let _ = writeln!(out, "{kind} robtarget pa{{3}}:=[{}];", list.join(",\n    "));
        for index in 1..=3 {
            self.targets.push(Named { name: format!("pa{{{index}}}"), pair, writable: kind != "CONST" });
        }
        let pair = self.pair();
        let value = self.target(pair);
        let _ = writeln!(out, "VAR job job1:=[{value},6,\"edge\"];");
        self.targets.push(Named { name: "job1.at".into(), pair, writable: true });
    }

    fn write(&mut self, made: &mut Made) {
        let data = self.data();
        let apart = self.chance(0.25);
        self.apart = apart;
        let mut main = String::from("PROC main()\n");
        if self.chance(0.35) {
            main.push_str("CONNECT int1 WITH trAdd;\nISignalDI distart,high,int1;\n");
        }
        if self.chance(0.3) {
            main.push_str("ConfJ\\On;\nConfL\\On;\n");
        }
        let count = self.rng.random_range(6..16);
        self.statements(&mut main, count, 0);
        main.push_str("ENDPROC\n");
        let routines = self.routines();
        let record = "RECORD job\nrobtarget at;\nnum lift;\nstring what;\nENDRECORD\n";
        if apart {
            let data = data.replace("LOCAL CONST", "CONST");
            made.files.push(("main.mod".into(), self.laid_out(&format!("MODULE progA\n{main}ENDMODULE\n"))));
            let rest = format!("MODULE progB(NOSTEPIN)\n{record}{data}{routines}ENDMODULE\n");
            made.files.push(("rest.mod".into(), self.laid_out(&rest)));
        } else {
            let whole = format!("MODULE prog\n{record}{data}{main}{routines}ENDMODULE\n");
            made.files.push(("prog.mod".into(), self.laid_out(&whole)));
        }
    }
}
