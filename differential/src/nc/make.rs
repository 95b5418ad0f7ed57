//! Random programs, as postprocessors and people write them: five axes in each block or words left out, arcs, and
//! changes of everything that holds on, few or many.

mod fanuc;
mod heidenhain;
mod linuxcnc;
mod round;
mod siemens;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Control;
use super::setting::{Angles, Pose, Setting, plain};
use crate::model::Case;

/// What programs may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Features {
    /// Shifts that are taken from where the tip stands: G92, G10 L20.
    pub presets: bool,
}

impl Default for Features {
    fn default() -> Self {
        Features { presets: true }
    }
}

/// What stands beside the program of a seed: a place that the arm reaches with every tool.
pub fn setting(seed: u64, control: Control, case: &Case) -> Setting {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x7365_7474);
    let tools = [
        ("T0", plain([0.0, 0.0, 0.0], [0.0; 3])),
        ("T1", plain([0.0, 0.0, 50.0], [0.0; 3])),
        ("T2", plain([20.0, 0.0, 90.0], [0.0; 3])),
        ("T3", plain([0.0, 5.0, 30.0], [0.0, 15.0, 0.0])),
    ];
    let mut centre = reached(case);
    if seed >= BORDERS && rng.random_bool(0.2) {
        // Towards the end of what the arm reaches, and to where it is stretched or folded.
        let farther = rng.random_range(0.7..1.45);
        centre = [0, 1, 2].map(|axis| (centre[axis] * if axis < 2 { farther } else { 1.0 }).round());
    }
    let shifts =
        [[0.0, 0.0, 0.0], [20.0, -30.0, 15.0], [-20.0, 20.0, 10.0], [0.0, 20.0, -10.0], [10.0, 10.0, 20.0]];
    let names: [&str; 5] = match control {
        Control::Fanuc => ["G54", "G55", "G56", "G57", "G54.1P2"],
        Control::LinuxCnc => ["G54", "G55", "G56", "G57", "G59.1"],
        Control::Siemens => ["G54", "G55", "G56", "G57", "G500"],
        Control::Heidenhain => ["G54", "PRESET1", "PRESET2", "PRESET3", "PRESET5"],
    };
    let frame = |at: usize| {
        // Where axes 1 and 6 of a tool that points down are near 45° and axis 4 near 0: a program says no configuration,
        // and there is no other that is as near to the zero of all axes.
        let turn = if at == 2 { [0.0, 0.0, 160.0] } else { [0.0, 0.0, 180.0] };
        (names[at].to_owned(), plain(std::array::from_fn(|axis| centre[axis] + shifts[at][axis]), turn))
    };
    let angles = [Angles::Wpr, Angles::Wpr, Angles::Abc, Angles::Rxyz][rng.random_range(0..4)];
    Setting {
        angles,
        tools: tools.map(|(name, pose)| (name.to_owned(), pose)).to_vec(),
        frames: (0..5).map(frame).collect(),
        increments: false,
        skip: false,
    }
}

/// From this seed on some programs go to where the arm hardly reaches. Those before are what they always were.
const BORDERS: u64 = 2_000_000;

/// From this seed on one program in three states no increments.
const INCREMENTS: u64 = 246_400_000;

/// A place before the arm about which it reaches with tools that point down (mm).
fn reached(case: &Case) -> [f64; 3] {
    let links = &case.arm.nominal;
    let reach = links[0].a + links[1].a + links[3].d;
    let down = plain([0.0; 3], [180.0, 0.0, 180.0]).rotation;
    let fits = |x: f64, z: f64| {
        [-60.0, 60.0].iter().all(|by| {
            let [out, side] = beside(x + by);
            let at = Pose::from_parts(nalgebra::Translation3::new(out, side, z + 60.0 + by), down);
            case.arm.nominal_inverse(&at, None).iter().any(|q| case.arm.map.axes(q)[4] > 0.1)
        })
    };
    for (out, up) in [(0.7, 0.44), (0.65, 0.4), (0.6, 0.4), (0.6, 0.5), (0.75, 0.3)] {
        let (x, z) = ((out * reach).round(), (up * reach).round());
        if fits(x, z) {
            let [out, side] = beside(x);
            return [out, side, z];
        }
    }
    let [out, side] = beside((0.7 * reach).round());
    [out, side, (0.44 * reach).round()]
}

/// A distance from the arm's axis 1, half way between x and y (mm).
fn beside(distance: f64) -> [f64; 2] {
    [(distance * std::f64::consts::FRAC_1_SQRT_2).round(); 2]
}

/// The program of a seed.
pub fn program(seed: u64, control: Control, setting: &Setting, features: Features) -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let density = [0.05, 0.15, 0.3, 0.5, 0.8][rng.random_range(0..5)];
    let centre = setting.frames[0].1.translation.vector.into();
    let mut maker = Maker {
        rng,
        control,
        angles: setting.angles,
        density,
        inch: false,
        number: 100,
        features,
        loops: 0,
        centre,
    };
    let head = setting.head(control);
    let lines = match control {
        Control::Fanuc => fanuc::program(&mut maker, &head),
        Control::LinuxCnc => linuxcnc::program(&mut maker, &head),
        Control::Siemens => siemens::program(&mut maker, &head),
        Control::Heidenhain => heidenhain::program(&mut maker, &head),
    };
    let mut text = lines.join("\n");
    text.push('\n');
    // Programs without increments, in which the places after a shift are known.
    if seed >= INCREMENTS && seed.is_multiple_of(3) {
        for (increment, absolute) in [
            ("G91\n", "G90\n"),
            ("G91 ", "G90 "),
            ("=IC(", "=AC("),
            (" IX", " X"),
            (" IY", " Y"),
            (" IZ", " Z"),
        ] {
            text = text.replace(increment, absolute);
        }
    }
    if maker.chance(0.1) { text.replace('\n', "\r\n") } else { text }
}

/// How a control writes its blocks.
struct Manner {
    /// Of the blocks that change what holds on, how many set one thing; the others part the way.
    changes: f64,
    change: fn(&mut Maker) -> Vec<String>,
    flow: fn(&mut Maker, f64, u32) -> Vec<String>,
    full: fn(&mut Maker) -> String,
    part: fn(&mut Maker) -> String,
    arc: fn(&mut Maker) -> Vec<String>,
    restate: fn(&mut Maker) -> Vec<String>,
}

/// What makes a program.
pub(super) struct Maker {
    rng: ChaCha8Rng,
    control: Control,
    angles: Angles,
    /// How many of the blocks change what holds on.
    density: f64,
    inch: bool,
    number: u32,
    features: Features,
    /// How many loops are open.
    loops: u32,
    /// Where the first work offset lies (mm).
    centre: [f64; 3],
}

impl Maker {
    fn chance(&mut self, share: f64) -> bool {
        self.rng.random_bool(share)
    }

    fn pick<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.rng.random_range(0..list.len())]
    }

    fn whole(&mut self, least: i32, most: i32) -> f64 {
        f64::from(self.rng.random_range(least..=most))
    }

    fn label(&mut self) -> u32 {
        self.number += 10;
        self.number
    }

    /// A place in the work area (mm): on a grid, or anywhere.
    fn place(&mut self) -> [f64; 3] {
        let free = self.chance(0.3);
        std::array::from_fn(|axis| {
            let (least, most) = if axis == 2 { (0, 8) } else { (-6, 6) };
            let fine = if free { self.whole(-2000, 2000) / 1000.0 } else { 0.0 };
            self.whole(least, most) * 5.0 + fine
        })
    }

    /// Angles of a tool that points down, nearly.
    fn turn(&mut self) -> [f64; 3] {
        let x = self.pick(&[0.0, 0.0, 5.0, -5.0, 2.25]);
        let y = self.pick(&[0.0, 0.0, 5.0, -5.0, 10.0]);
        let z = self.pick(&[0.0, 0.0, 10.0, -10.0, 20.0]);
        self.angles.down(x, y, z)
    }

    fn unit(&self) -> f64 {
        if self.inch { 25.4 } else { 1.0 }
    }

    /// A length (mm) as it is written in the unit that holds.
    fn length(&mut self, mm: f64) -> String {
        let value = mm / self.unit();
        self.number_of(value)
    }

    /// A number in the manner of the control.
    fn number_of(&mut self, value: f64) -> String {
        let mut text = format!("{value:.3}").trim_end_matches('0').to_owned();
        match self.control {
            Control::Fanuc => {}
            Control::Heidenhain => {
                text = text.trim_end_matches('.').to_owned();
                if !text.starts_with('-') {
                    text.insert(0, '+');
                }
                if self.chance(0.1) {
                    text = text.replace('.', ",");
                }
            }
            _ => text = text.trim_end_matches('.').to_owned(),
        }
        if text == "-0" || text == "-0." { text.replace('-', "") } else { text }
    }

    /// `X10.` from a letter and a length (mm).
    fn axis(&mut self, letter: &str, mm: f64) -> String {
        let text = self.length(mm);
        format!("{letter}{text}")
    }

    /// `A180.`, `A=180` from a letter and an angle (°).
    fn angle(&mut self, letter: &str, degrees: f64) -> String {
        let text = self.number_of(degrees);
        let sign = if self.control == Control::Siemens { "=" } else { "" };
        format!("{letter}{sign}{text}")
    }

    /// All six words of a place.
    fn six(&mut self) -> String {
        let (place, turn) = (self.place(), self.turn());
        let mut words: Vec<String> = (0..3).map(|at| self.axis(["X", "Y", "Z"][at], place[at])).collect();
        words.extend((0..3).map(|at| self.angle(["A", "B", "C"][at], turn[at])));
        words.join(" ")
    }

    /// Some of the words of a place; lengths may be computed by `formula`.
    fn some(&mut self, formula: fn(&mut Maker, &str) -> String) -> String {
        let (place, turn) = (self.place(), self.turn());
        let mut words = Vec::new();
        for at in 0..3 {
            if self.chance(0.5) {
                let letter = ["X", "Y", "Z"][at];
                let word =
                    if self.chance(0.85) { self.axis(letter, place[at]) } else { formula(self, letter) };
                words.push(word);
            }
        }
        for at in 0..3 {
            if self.chance(0.2) {
                words.push(self.angle(["A", "B", "C"][at], turn[at]));
            }
        }
        if words.is_empty() {
            words.push(self.axis("X", place[0]));
        }
        words.join(" ")
    }

    /// A few blocks in the manner of a control.
    fn block(&mut self, manner: &Manner, depth: u32) -> Vec<String> {
        let density = self.density;
        if self.chance(density) {
            let kind = self.rng_share();
            if kind < manner.changes || depth > 1 {
                return (manner.change)(self);
            }
            return (manner.flow)(self, kind, depth);
        }
        match self.rng_share() {
            k if k < 0.35 => vec![(manner.full)(self)],
            k if k < 0.75 => vec![(manner.part)(self)],
            k if k < 0.92 => (manner.arc)(self),
            _ => (manner.restate)(self),
        }
    }

    /// Blocks until a program is long enough.
    fn body(&mut self, block: fn(&mut Maker, u32) -> Vec<String>) -> Vec<String> {
        let count = self.rng.random_range(8..28);
        (0..count).flat_map(|_| block(self, 0)).collect()
    }

    fn rng_share(&mut self) -> f64 {
        self.rng.random_range(0.0..1.0)
    }
}
