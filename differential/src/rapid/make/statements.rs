//! Statements of random programs.

use std::fmt::Write;

use nalgebra::UnitQuaternion;
use rand::RngExt;

use super::{Maker, Named, Pair};

impl Maker<'_> {
    /// Tool and object by name.
    pub(super) fn names(&self, pair: Pair) -> (&'static str, &'static str) {
        (self.tools[pair.tool].name, self.objects[pair.object].name)
    }

    fn named(&mut self) -> Named {
        self.targets[self.rng.random_range(0..self.targets.len())].clone()
    }

    fn writable(&mut self) -> Named {
        loop {
            let named = self.named();
            if named.writable {
                return named;
            }
        }
    }

    /// A small number in words.
    pub(super) fn amount(&mut self) -> String {
        let effects = self.features.effects;
        match self.rng.random_range(0..20) {
            0 => "gap".into(),
            1 => "-gap/2".into(),
            2 => "lifts{2}".into(),
            3 => "n1".into(),
            4 => "fLift()".into(),
            5 => "fTwice(3)".into(),
            6 => "2*(1+3)-4".into(),
            7 => "np".into(),
            8 => "Abs(-3.25)".into(),
            9 => "7 DIV 2+7 MOD 4".into(),
            10 => "10*Sin(30)".into(),
            18 => "n2".into(),
            11 if effects => "fNext(n1)".into(),
            12 if effects => "fSay()".into(),
            13 if effects => "fMoves()".into(),
            14 => "lifts{1+n3*0}".into(),
            15 => "-fLift()".into(),
            _ => format!("{:.2}", self.rng.random_range(-12.0..12.0f64)),
        }
    }

    /// A small number as it may stand behind a plus: a sign there wants parentheses.
    fn addend(&mut self) -> String {
        let amount = self.amount();
        if amount.starts_with('-') { format!("({amount})") } else { amount }
    }

    /// A target as an argument, and the pair for which it was made.
    fn argument(&mut self) -> (String, Pair) {
        let named = self.named();
        let (name, pair) = (named.name, named.pair);
        let text = match self.rng.random_range(0..24) {
            0..=5 => {
                let pair = self.pair();
                return (self.target(pair), pair);
            }
            6..=9 => {
                let (x, y, z) = (self.amount(), self.amount(), self.amount());
                format!("Offs({name},{x},{y},{z})")
            }
            10 => {
                let (x, z) = (self.amount(), self.amount());
                format!("RelTool({name},{x},0,{z}\\Rx:=2.5\\Rz:=-4)")
            }
            11 => format!("RelTool({name},0,{},-3)", self.amount()),
            12 => format!("fUp({name},{})", self.amount()),
            13 if self.features.effects => format!("fCount({name})"),
            18 if self.features.effects => {
                let what = self.pick(&["fNote(5)", "fNext(n1)", "fMoves()", "fSay()", "fNote(n1)"]);
                format!("fPick({name},{what})")
            }
            14 => format!("Offs(fUp({name},2),1,{},0)", self.amount()),
            15 => format!("[{name}.trans,{name}.rot,{name}.robconf,{name}.extax]"),
            16 => format!("[{name}.trans+[1,{},-2],{name}.rot,{name}.robconf,{name}.extax]", self.amount()),
            17 => format!("Offs(Offs({name},1,2,3),-1,{},0)", self.amount()),
            _ => name,
        };
        (text, pair)
    }

    fn speed(&mut self) -> String {
        match self.rng.random_range(0..10) {
            0 => "v100\\V:=40".into(),
            1 => "[150,500,5000,1000]".into(),
            _ => self.pick(&["v20", "v50", "v100", "v200", "v500"]).into(),
        }
    }

    /// One motion.
    pub(super) fn motion(&mut self, out: &mut String) {
        let (target, mut pair) = self.argument();
        if self.chance(0.07) {
            pair = self.pair();
        }
        let (tool, object) = self.names(pair);
        if self.features.wrapped && self.chance(0.5) {
            return self.wrapped(out, &target, pair);
        }
        let object = match object {
            "wobj0" if self.chance(0.7) => String::new(),
            other => self.pick(&["\\WObj:=", ",\\WObj:=", "\\wobj := "]).to_owned() + other,
        };
        let speed = self.speed();
        let zone = self.pick(&["fine", "fine", "z0", "z1", "z5", "z10"]);
        let zone = if self.chance(0.06) { format!("{zone}\\Z:=3") } else { zone.to_owned() };
        let _ = match self.rng.random_range(0..20) {
            0..=11 => writeln!(out, "MoveL {target},{speed},{zone},{tool}{object};"),
            12..=15 => writeln!(out, "MoveJ {target},{speed},{zone},{tool}{object};"),
            16 | 17 => {
                let via = self.target(pair);
                writeln!(out, "MoveC {via},{target},{speed},{zone},{tool}{object};")
            }
            18 => {
                let joints = self.joints.first().cloned().filter(|_| self.chance(0.6));
                let joints = match joints {
                    Some(name) => name,
                    None => self.jointtarget(),
                };
                let object = if self.tools[pair.tool].held { "" } else { &object };
                writeln!(out, "MoveAbsJ {joints}\\NoEOffs,{speed},{zone},{tool}{object};")
            }
            _ => writeln!(out, "MoveLDO {target},{speed},{zone},{tool}{object},doSpindle,1;"),
        };
    }

    /// One motion by a routine that does nothing else.
    fn wrapped(&mut self, out: &mut String, target: &str, pair: Pair) {
        let (tool, object) = self.names(pair);
        let speed = self.pick(&["v20", "v50", "[150,500,5000,1000]"]);
        let zone = self.pick(&["fine", "fine", "z0", "z1", "z5"]);
        // The routines of the file that holds them alone.
        let local = if self.apart { "wLine" } else { "wJoint" };
        let last = if self.apart { format!("\\w:={object}") } else { format!(",{object}") };
        let _ = match self.rng.random_range(0..12) {
            0..=3 if object == "wobj0" => writeln!(out, "wLine {target},{speed},{zone},{tool};"),
            0..=3 => writeln!(out, "wLine {target},{speed},{zone},{tool}\\w:={object};"),
            4 | 5 => writeln!(out, "{local} {target},{speed},{zone},{tool}{last};"),
            6 => {
                let via = self.target(pair);
                writeln!(out, "wArc {via},{target},{speed},{zone},{tool},{object};")
            }
            7 | 8 => writeln!(out, "wDeep {target},{tool}\\w:={object};"),
            9 => writeln!(out, "wLine goal:={target},z:={zone},v:={speed},t:={tool}\\w:={object};"),
            10 => writeln!(out, "wHere {},{target};", self.amount()),
            _ => writeln!(out, "wKeep {target},{speed},{zone},{tool},{object};"),
        };
    }

    pub(super) fn statements(&mut self, out: &mut String, count: usize, depth: usize) {
        for _ in 0..count {
            if self.chance(0.55) {
                self.motion(out);
            } else {
                self.other(out, depth);
            }
        }
    }

    fn condition(&mut self) -> String {
        self.pick(&[
            "n1>1",
            "b1",
            "n1=n2",
            "fTest(n1)",
            "DInput(doGrip)=1",
            "NOT b1",
            "n1<4 AND n2<>1",
            "TRUE",
            "gap>4",
        ])
        .into()
    }

    fn block(&mut self, out: &mut String, depth: usize) {
        let count = self.rng.random_range(1..4);
        self.statements(out, count, depth + 1);
    }

    fn other(&mut self, out: &mut String, depth: usize) {
        let deep = depth >= 2;
        match self.rng.random_range(0..30) {
            0..=3 => self.assignment(out),
            4 | 5 if !deep => self.branch(out, depth),
            6 | 7 if !deep => self.repeated(out, depth),
            8 if !deep => {
                out.push_str("TEST n1\nCASE 1,2:\n");
                self.block(out, depth);
                out.push_str("CASE 3:\n");
                self.block(out, depth);
                if self.chance(0.6) {
                    out.push_str("DEFAULT:\n");
                    self.block(out, depth);
                }
                out.push_str("ENDTEST\n");
            }
            9 if depth == 0 => {
                self.labels += 1;
                let label = format!("lab{}", self.labels);
                let condition = self.condition();
                let _ = writeln!(out, "IF {condition} GOTO {label};");
                self.block(out, depth);
                let _ = writeln!(out, "{label}:");
            }
            10 => {
                let text = self.pick(&[
                    "TPWrite \"at\"\\Num:=n1;",
                    "TPWrite s1;",
                    "SetDO doSpindle,1;",
                    "WaitTime 0.5;",
                    "Reset doGrip;",
                ]);
                let _ = writeln!(out, "{text}");
            }
            11 => self.displacement(out),
            12 => {
                let text =
                    self.pick(&["ConfL\\Off;", "ConfL\\On;", "ConfJ\\Off;", "ConfJ\\On;", "ConfL\\On;"]);
                let _ = writeln!(out, "{text}");
            }
            13 => {
                let text = self.pick(&["GripLoad ldPart;", "GripLoad load0;", "GripLoad ldPart;"]);
                let _ = writeln!(out, "{text}");
            }
            14 => {
                let text = self.pick(&[
                    "SingArea\\Wrist;",
                    "SingArea\\Off;",
                    "SoftAct 1,20;",
                    "SoftDeact;",
                    "AccSet 80,80;",
                    "SoftDeact;",
                ]);
                let _ = writeln!(out, "{text}");
            }
            15 => {
                let named = self.named();
                let target = self.pick(&[
                    "tGrind.tframe.trans.z",
                    "tSmall.tframe.trans",
                    "wPart.oframe.trans.x",
                    "wRoom.oframe.trans.y",
                ]);
                let _ = match target {
                    "tSmall.tframe.trans" => writeln!(out, "{target}:={target}+[0.5,0,1];"),
                    _ => writeln!(out, "{target}:={target}+{};", self.addend()),
                };
                let _ = named;
            }
            16..=22 => self.called(out),
            _ => self.motion(out),
        }
    }

    fn assignment(&mut self, out: &mut String) {
        let named = self.writable();
        let other =
            self.targets.iter().filter(|t| t.pair == named.pair).map(|t| t.name.clone()).collect::<Vec<_>>();
        let other = other[self.rng.random_range(0..other.len())].clone();
        let name = named.name;
        let _ = match self.rng.random_range(0..14) {
            0 => writeln!(out, "n1:=n1+1;"),
            1 => writeln!(out, "n1:={};", self.rng.random_range(0..5)),
            2 => writeln!(out, "b1:=NOT b1;"),
            3 => writeln!(out, "Incr n1;"),
            4 => writeln!(out, "{name}.trans.z:={name}.trans.z+{};", self.addend()),
            5 => writeln!(out, "{name}.trans:={other}.trans;"),
            6 => writeln!(out, "{name}:={};", self.target(named.pair)),
            7 => writeln!(out, "{name}:=Offs({other},{},0,1);", self.amount()),
            8 => writeln!(out, "{name}:={other};"),
            9 => writeln!(out, "np:=np+0.5;"),
            10 => writeln!(out, "n2:={name}.trans.x;"),
            11 => writeln!(out, "s1:=\"n\"+NumToStr(n1,1);"),
            12 => writeln!(out, "{name}.rot:=OrientZYX(3,0,-2)*{name}.rot;"),
            _ => writeln!(out, "shift2.trans:=[1,{},2];", self.amount()),
        };
    }

    fn branch(&mut self, out: &mut String, depth: usize) {
        let condition = self.condition();
        if self.chance(0.25) {
            let _ = write!(out, "IF {condition} ");
            if self.chance(0.6) {
                self.motion(out)
            } else {
                self.assignment(out)
            }
            return;
        }
        let _ = writeln!(out, "IF {condition} THEN");
        self.block(out, depth);
        if self.chance(0.3) {
            let condition = self.condition();
            let _ = writeln!(out, "ELSEIF {condition} THEN");
            self.block(out, depth);
        }
        if self.chance(0.5) {
            out.push_str("ELSE\n");
            self.block(out, depth);
        }
        out.push_str("ENDIF\n");
    }

    fn repeated(&mut self, out: &mut String, depth: usize) {
        self.loops += 1;
        let name = format!("i{}", self.loops);
        if self.chance(0.3) {
            out.push_str("n3:=0;\nWHILE n3<2 DO\nn3:=n3+1;\n");
            self.block(out, depth.max(1));
            out.push_str("ENDWHILE\nn3:=0;\n");
            return;
        }
        let range = self.pick(&["1 TO 3", "1 TO 2", "3 TO 1 STEP -1", "2 TO 1", "0 TO 4 STEP 2"]);
        let _ = writeln!(out, "FOR {name} FROM {range} DO");
        if self.chance(0.6) {
            let named = self.named();
            let (tool, object) = self.names(named.pair);
            let name_of = named.name;
            let _ = writeln!(out, "MoveL Offs({name_of},{name}*2,0,{name}),v100,z1,{tool}\\WObj:={object};");
        }
        self.block(out, depth);
        out.push_str("ENDFOR\n");
    }

    /// A displacement from the programmed point to where the robot stands then, after one motion or another.
    fn placed(&mut self, out: &mut String) {
        let named = self.named();
        let (tool, object) = self.names(named.pair);
        let name = &named.name;
        let go = |maker: &mut Self, out: &mut String| {
            let target = match maker.rng.random_range(0..3) {
                0 => format!("Offs({name},2,-1,{})", maker.amount()),
                1 => name.clone(),
                _ => maker.target(named.pair),
            };
            let way = maker.pick(&["MoveL", "MoveL", "MoveJ"]);
            let _ = writeln!(out, "{way} {target},v100,fine,{tool}\\WObj:={object};");
        };
        out.push_str("PDispOff;\n");
        if self.chance(0.6) {
            let condition = self.condition();
            let _ = writeln!(out, "IF {condition} THEN");
            go(self, out);
            out.push_str("ELSE\n");
            go(self, out);
            out.push_str("ENDIF\n");
        } else {
            go(self, out);
        }
        let turned = self.pick(&["", "\\Rot"]);
        let comma = if turned.is_empty() { "" } else { "," };
        let _ = writeln!(out, "PDispOn{turned}{comma} {name},{tool}\\WObj:={object};");
    }

    fn displacement(&mut self, out: &mut String) {
        if self.features.placed && self.chance(0.5) {
            return self.placed(out);
        }
        let named = self.named();
        let (tool, object) = self.names(named.pair);
        let name = named.name;
        let _ = match self.rng.random_range(0..6) {
            0 | 1 => writeln!(out, "PDispSet shift1;"),
            2 => writeln!(out, "PDispSet shift2;"),
            3 => {
                writeln!(out, "PDispOff;\nPDispOn\\ExeP:=Offs({name},3,0,-2),{name},{tool}\\WObj:={object};")
            }
            _ => writeln!(out, "PDispOff;"),
        };
    }

    fn called(&mut self, out: &mut String) {
        let named = self.named();
        let writable = self.writable();
        let name = named.name;
        let _ = match self.rng.random_range(0..12) {
            0 => writeln!(out, "pMove {name},{};", self.amount()),
            1 => writeln!(out, "pMove {name},3\\side:=4;"),
            2 => writeln!(out, "pMove {name},1\\back;"),
            3 => writeln!(out, "pShift {},2;", writable.name),
            4 => writeln!(out, "pShift {},{};", writable.name, self.amount()),
            5 => writeln!(out, "pMany pa;"),
            6 => {
                let (tool, object) = self.names(named.pair);
                writeln!(out, "pTool {tool},{object},{name};")
            }
            7 => writeln!(out, "pSafe {};", self.rng.random_range(0..4)),
            8 => writeln!(out, "%\"pLate\"+NumToStr({},0)%;", self.pick(&["1", "2", "np", "1"])),
            9 => writeln!(out, "pLate{};", self.rng.random_range(1..3)),
            10 => writeln!(out, "%\"pLate\"+NumToStr(1,0)%;"),
            _ => writeln!(out, "pSafe n1;"),
        };
        let _ = UnitQuaternion::<f64>::identity();
    }
}
