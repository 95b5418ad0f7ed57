//! What the words of a Fanuc block do, in the order of the control.

use super::super::arc::Circle;
use super::super::machine::{Mode, Say, Words};
use super::super::setting::Pose;
use super::{Block, Fanuc};

const AXES: [char; 3] = ['X', 'Y', 'Z'];
const TURNS: [char; 3] = ['A', 'B', 'C'];

impl Fanuc<'_> {
    /// Where the coordinates of the program are, from the offset in use and the shifts in it.
    pub fn recount(&mut self) {
        let chain = self.chain();
        self.machine.recount(chain);
    }

    fn chain(&self) -> Option<Pose> {
        let frame = self.frames.get(&self.frame).copied()?;
        let [x, y, z] = self.zero();
        Some(frame * Pose::translation(x?, y?, z?))
    }

    /// What G92 and G52 shift together.
    fn zero(&self) -> [Option<f64>; 3] {
        std::array::from_fn(|axis| self.preset[axis].map(|preset| preset + self.local[axis]))
    }

    /// G92 or G52 has shifted the named axes, from where `before` tells; the others keep zero and value, whether it is told
    /// where that zero lies or not.
    fn shifted(&mut self, before: [Option<f64>; 3], named: [bool; 3]) {
        let zero = self.zero();
        let by = std::array::from_fn(|axis| match named[axis] {
            true => zero[axis].zip(before[axis]).map(|(new, old)| new - old),
            false => Some(0.0),
        });
        let chain = self.chain();
        self.machine.move_zero(by, chain);
    }

    /// The length that a word means: without a point it may count thousandths.
    fn length(&self, word: (char, f64, bool)) -> f64 {
        let share = if !word.2 && self.machine.setting.increments { 1e-3 } else { 1.0 };
        word.1 * share * self.machine.unit
    }

    fn lengths(&self, block: &Block, letters: [char; 3]) -> [Option<f64>; 3] {
        letters.map(|letter| {
            let word = block.words.iter().rev().find(|(other, ..)| *other == letter)?;
            Some(self.length(*word))
        })
    }

    /// One block.
    pub(super) fn machine_block(&mut self, block: &Block) -> Result<(), String> {
        if let Some(feed) = block.get('F') {
            self.machine.feed = format!("{feed}");
        }
        if let Some(speed) = block.get('S') {
            self.machine.note(format!("S{speed}"));
        }
        if let Some(tool) = block.get('T') {
            self.waiting = Some(tool as i32);
        }
        for &switch in &block.switches {
            self.machine.note(format!("M{switch}"));
            if let (6, Some(tool)) = (switch, self.waiting) {
                self.machine.tool = Some(format!("T{tool}"));
                self.machine.note(format!("T{tool}"));
                self.machine.lost();
            }
        }
        self.modes(block);
        self.coordinates(block)?;
        if block.has(40) {
            let time = block.get('P').or(block.get('X'));
            self.machine.note(format!("wait {time:?}"));
            return Ok(());
        }
        if self.shifts(block) || self.returns(block) {
            return Ok(());
        }
        self.motion(block);
        Ok(())
    }

    /// Words that hold on and move nothing.
    fn modes(&mut self, block: &Block) {
        let machine = &mut self.machine;
        for &code in &block.codes {
            match code {
                0 => machine.mode = Mode::Rapid,
                10 => machine.mode = Mode::Line,
                20 => machine.mode = Mode::Clockwise,
                30 => machine.mode = Mode::Anticlockwise,
                170 | 180 | 190 => machine.plane = (code / 10) as u8,
                200 => machine.unit = 25.4,
                210 => machine.unit = 1.0,
                900 => machine.absolute = true,
                910 => machine.absolute = false,
                400 | 410 | 420 => machine.side = (code / 10) as u8,
                810..=890 => machine.mode = Mode::Other((code / 10) as u16),
                800 if matches!(machine.mode, Mode::Other(_)) => machine.mode = Mode::Rapid,
                610 | 640 => machine.note(format!("G{}", code / 10)),
                _ => {}
            }
        }
    }

    /// Work offsets, lengths of tools, what bends coordinates.
    fn coordinates(&mut self, block: &Block) -> Result<(), String> {
        for &code in &block.codes {
            match code {
                540..=599 => {
                    self.frame = match code {
                        541 => format!("G54.1P{}", block.get('P').ok_or("P")?),
                        _ => format!("G{}", code / 10),
                    };
                    self.recount();
                }
                430 | 434 | 490 => {
                    let number = block.get('H').filter(|_| code != 490);
                    let tool = number.map_or(self.machine.tool.clone(), |number| Some(format!("T{number}")));
                    self.machine.follow_tip(code == 434);
                    self.machine.measure(tool);
                }
                680 => self.machine.bend("turned", true),
                690 => self.machine.bend("turned", false),
                511 => self.machine.bend("mirrored", true),
                501 => self.machine.bend("mirrored", false),
                510 => self.machine.bend("scaled", true),
                500 => self.machine.bend("scaled", false),
                160 => self.machine.bend("polar", true),
                150 => self.machine.bend("polar", false),
                _ => {}
            }
        }
        Ok(())
    }

    /// G92, G52 and G10; true where the block does nothing else.
    fn shifts(&mut self, block: &Block) -> bool {
        let places = self.lengths(block, AXES);
        let (before, named) = (self.zero(), places.map(|place| place.is_some()));
        if block.has(920) {
            for (axis, place) in places.iter().enumerate() {
                if let Some(place) = place {
                    // The zero moves so that the tip, where it is, stands at this value.
                    let zero = self.preset[axis].zip(self.machine.at[axis]);
                    self.preset[axis] = zero.map(|(zero, at)| zero + at - place);
                }
            }
            self.shifted(before, named);
            // The named axes stand where it says, even where nothing else is known.
            for (axis, place) in places.iter().enumerate() {
                if place.is_some() && self.machine.at[axis].is_none() {
                    self.machine.at[axis] = *place;
                }
            }
            return true;
        }
        if block.has(921) {
            for (axis, place) in places.iter().enumerate() {
                if place.is_some() {
                    // Back to the offset itself: what G92 and what G52 have shifted goes (30i operator's manual, workpiece
                    // coordinate system preset).
                    (self.preset[axis], self.local[axis]) = (Some(0.0), 0.0);
                }
            }
            self.shifted(before, named);
            return true;
        }
        if block.has(520) {
            for (axis, place) in places.iter().enumerate() {
                if let Some(place) = place {
                    self.local[axis] = *place;
                }
            }
            self.shifted(before, named);
            return true;
        }
        if block.has(100) {
            if block.get('L') == Some(2.0) {
                let name = format!("G{}", 53 + block.get('P').unwrap_or(0.0) as i32);
                let add = !self.machine.absolute;
                if let Some(frame) = self.frames.get_mut(&name) {
                    for (axis, place) in places.iter().enumerate() {
                        if let Some(place) = place {
                            let old = if add { frame.translation.vector[axis] } else { 0.0 };
                            frame.translation.vector[axis] = old + place;
                        }
                    }
                }
                if name == self.frame {
                    self.recount();
                }
            }
            return true;
        }
        false
    }

    /// G53, G28, G30 and cycles; true where the block does nothing else.
    fn returns(&mut self, block: &Block) -> bool {
        for (code, begins) in [(280, false), (300, false), (310, true), (530, false)] {
            if block.has(code) {
                let named = AXES.map(|letter| begins || block.get(letter).is_some());
                self.machine.some_elsewhere(block.text.clone(), begins, named);
                return true;
            }
        }
        if let Mode::Other(code) = self.machine.mode
            && block.words.iter().any(|(letter, ..)| "XYZR".contains(*letter))
        {
            self.machine.elsewhere(format!("G{code} {}", block.text), true);
            return true;
        }
        false
    }

    fn motion(&mut self, block: &Block) {
        let mut words = Words::default();
        let absolute = self.machine.absolute;
        let say = |value: f64| if absolute { Say::To(value) } else { Say::By(value) };
        let places = self.lengths(block, AXES);
        words.place = places.map(|place| place.map(say));
        words.turn = TURNS.map(|letter| block.get(letter).map(say));
        if !words.moves() && !block.words.iter().any(|(letter, ..)| "IJK".contains(*letter)) {
            return;
        }
        if matches!(self.machine.mode, Mode::Clockwise | Mode::Anticlockwise) {
            words.circle = Some(match self.lengths(block, ['R', 'R', 'R'])[0] {
                Some(radius) => Circle::Radius(radius),
                None => {
                    let offsets = self.lengths(block, ['I', 'J', 'K']);
                    let at = self.machine.at;
                    Circle::Centre(std::array::from_fn(|axis| Some(at[axis]? + offsets[axis]?)))
                }
            });
        }
        if words.moves() {
            self.machine.go(words);
        }
    }
}
