//! What the words of a LinuxCNC block do, in its order of execution: feed, spindle, tool, length, coordinates, distance,
//! shifts, motion.

use super::super::arc::Circle;
use super::super::machine::{Mode, Say, Words};
use super::super::setting::{Pose, plain};
use super::{Block, LinuxCnc};

const AXES: [char; 3] = ['X', 'Y', 'Z'];

impl LinuxCnc<'_> {
    pub fn recount(&mut self) {
        let chain = self.chain();
        self.machine.recount(chain);
    }

    /// Where the coordinates of the program are, from the offset in use and the zero of G92 and G52 in it.
    fn chain(&self) -> Option<Pose> {
        // How offsets of rotary axes turn A, B and C is not followed.
        let straight = self.rotary.get(&self.frame).is_none_or(|angles| *angles == [0.0; 3]);
        let frame = self.frames.get(&self.frame).copied().filter(|_| straight)?;
        let [x, y, z] = self.shift;
        Some(frame * Pose::translation(x?, y?, z?))
    }

    /// The zero of G92 and G52 becomes another for the named axes. An axis that is not named keeps its zero and its value,
    /// whether it is told where that zero lies or not (LinuxCNC, coordinate systems, "local and global offsets").
    fn shift_to(&mut self, shift: [Option<f64>; 3], named: [bool; 3]) {
        let by = std::array::from_fn(|axis| match named[axis] {
            true => shift[axis].zip(self.shift[axis]).map(|(new, old)| new - old),
            false => Some(0.0),
        });
        self.shift = shift;
        let chain = self.chain();
        self.machine.move_zero(by, chain);
    }

    pub(super) fn act(&mut self, block: &Block) -> Result<(), String> {
        if let Some(feed) = block.get('F') {
            self.machine.feed = format!("{feed}");
        }
        if let Some(speed) = block.get('S') {
            self.machine.note(format!("S{speed}"));
        }
        if let Some(tool) = block.get('T') {
            self.waiting = Some(tool as i32);
        }
        self.switches(block)?;
        for &code in &block.codes {
            let machine = &mut self.machine;
            match code {
                170 | 180 | 190 => machine.plane = (code / 10) as u8,
                200 => machine.unit = 25.4,
                210 => machine.unit = 1.0,
                400 | 410 | 420 => machine.side = (code / 10) as u8,
                901 => self.arcs_absolute = true,
                911 => self.arcs_absolute = false,
                610 | 611 | 640 => machine.note(format!("G{code}")),
                _ => {}
            }
        }
        self.lengths_of_tools(block);
        self.offsets(block)?;
        for &code in &block.codes {
            match code {
                900 => self.machine.absolute = true,
                910 => self.machine.absolute = false,
                _ => {}
            }
        }
        if block.has(40) {
            self.machine.note(format!("wait {:?}", block.get('P')));
        }
        if self.shifts(block)? {
            return Ok(());
        }
        self.motion(block);
        Ok(())
    }

    fn switches(&mut self, block: &Block) -> Result<(), String> {
        for &switch in &block.switches {
            self.machine.note(format!("M{switch}"));
            match switch {
                6 => {
                    if let Some(tool) = self.waiting {
                        self.spindle = format!("T{tool}");
                        self.machine.tool = Some(self.spindle.clone());
                        self.machine.note(self.spindle.clone());
                    }
                    self.machine.lost();
                }
                61 => {
                    self.spindle = format!("T{}", block.get('Q').ok_or("Q")?);
                    self.machine.tool = Some(self.spindle.clone());
                    self.machine.lost();
                }
                70 | 73 => {
                    let m = &self.machine;
                    let kept = (m.mode, m.plane, m.unit, m.absolute, self.arcs_absolute);
                    let (feed, frame) = (m.feed.clone(), self.frame.clone());
                    self.kept = Some((kept.0, kept.1, kept.2, kept.3, kept.4, feed, frame));
                }
                71 => self.kept = None,
                72 => {
                    if let Some((_, plane, unit, absolute, arcs, feed, frame)) = self.kept.clone() {
                        let m = &mut self.machine;
                        (m.plane, m.unit, m.absolute, m.feed) = (plane, unit, absolute, feed);
                        self.arcs_absolute = arcs;
                        if frame != self.frame {
                            self.frame = frame;
                            self.recount();
                        }
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn lengths_of_tools(&mut self, block: &Block) {
        if block.has(430) {
            self.machine.measure(Some(match block.get('H') {
                Some(number) if number != 0.0 => format!("T{number}"),
                Some(_) => "T0".to_owned(),
                None => self.spindle.clone(),
            }));
        }
        if block.has(431) {
            self.machine.tool = None;
            self.machine.lost();
        }
        if block.has(490) {
            self.machine.measure(Some(self.spindle.clone()));
        }
    }

    fn offsets(&mut self, block: &Block) -> Result<(), String> {
        for &code in &block.codes {
            if (540..=593).contains(&code) && (code % 10 == 0 || code > 590) {
                let name =
                    if code % 10 == 0 { format!("G{}", code / 10) } else { format!("G59.{}", code % 10) };
                // The offset in use, selected again, changes nothing.
                if name != self.frame {
                    self.frame = name;
                    self.recount();
                }
            }
        }
        Ok(())
    }

    fn places(&self, block: &Block) -> [Option<f64>; 3] {
        AXES.map(|letter| block.get(letter).map(|value| value * self.machine.unit))
    }

    /// G10, G92, G52, G28, G30, G53, probing and paths that are not followed; true where the block does nothing else.
    fn shifts(&mut self, block: &Block) -> Result<bool, String> {
        let places = self.places(block);
        if block.has(100) {
            self.set_offset(block, places);
            return Ok(true);
        }
        let named = places.map(|place| place.is_some());
        if block.has(920) {
            let mut shift = self.shift;
            for (axis, place) in places.iter().enumerate() {
                if let Some(place) = place {
                    let zero = shift[axis].zip(self.machine.at[axis]);
                    shift[axis] = zero.map(|(zero, at)| zero + at - place);
                }
            }
            self.shift_to(shift, named);
            self.kept_shift = shift;
            for (axis, place) in places.iter().enumerate() {
                if place.is_some() && self.machine.at[axis].is_none() {
                    self.machine.at[axis] = *place;
                }
            }
            return Ok(true);
        }
        if block.has(520) {
            let shift = std::array::from_fn(|axis| places[axis].or(self.shift[axis]));
            self.shift_to(shift, named);
            return Ok(true);
        }
        if block.has(921) || block.has(922) {
            self.kept_shift = if block.has(921) { [Some(0.0); 3] } else { self.shift };
            self.shift_to([Some(0.0); 3], [true; 3]);
        }
        if block.has(923) {
            self.shift_to(self.kept_shift, [true; 3]);
        }
        for (code, begins) in [(280, false), (300, false), (530, false), (382, true), (383, true)] {
            if block.has(code) {
                self.mode_of(block);
                let none = AXES.iter().all(|letter| block.get(*letter).is_none());
                let named = AXES.map(|letter| none || block.get(letter).is_some());
                self.machine.some_elsewhere(block.text.clone(), begins, named);
                return Ok(true);
            }
        }
        if let Some(code) = [50, 51, 330, 331, 810, 820, 830].iter().find(|code| block.has(**code)) {
            self.machine.mode = Mode::Other(*code as u16);
            self.machine.elsewhere(block.text.clone(), true);
            return Ok(true);
        }
        Ok(false)
    }

    fn set_offset(&mut self, block: &Block, places: [Option<f64>; 3]) {
        let number = block.get('P').unwrap_or(0.0).round() as i32;
        let name = match number {
            0 => self.frame.clone(),
            1..=6 => format!("G{}", 53 + number),
            _ => format!("G59.{}", number - 6),
        };
        match block.get('L').map(|l| l.round() as i32) {
            Some(2) => {
                self.set_place(block, places, &name);
                let rotary = self.rotary.entry(name.clone()).or_insert([0.0; 3]);
                for (angle, letter) in rotary.iter_mut().zip(['A', 'B', 'C']) {
                    *angle = block.get(letter).unwrap_or(*angle);
                }
            }
            Some(20) => {
                // The offset becomes what makes the place here read so; where the tip is decides.
                let [x, y, z] = self.machine.at;
                let here = x.zip(y).zip(z).filter(|_| name == self.frame && self.shift == [Some(0.0); 3]);
                match (here, self.frames.get_mut(&name)) {
                    (Some(((x, y), z)), Some(frame)) => {
                        let at = [x, y, z];
                        let by: [f64; 3] =
                            std::array::from_fn(|axis| places[axis].map_or(0.0, |place| at[axis] - place));
                        *frame *= Pose::translation(by[0], by[1], by[2]);
                    }
                    _ => {
                        let gone = self.frames.remove(&name);
                        self.unplaced.extend(gone.map(|frame| (name.clone(), frame.rotation)));
                    }
                }
            }
            _ => {}
        }
        if name == self.frame {
            self.recount();
        }
    }

    /// Where an offset lies, and how it is turned about Z (R).
    fn set_place(&mut self, block: &Block, places: [Option<f64>; 3], name: &str) {
        let known = self.frames.get(name).map(|frame| frame.translation.vector);
        let Some(rotation) = self.frames.get(name).map(|f| f.rotation).or(self.unplaced.get(name).copied())
        else {
            return;
        };
        let rotation = block.get('R').map_or(rotation, |turn| plain([0.0; 3], [0.0, 0.0, turn]).rotation);
        let at: [Option<f64>; 3] = std::array::from_fn(|axis| places[axis].or(known.map(|at| at[axis])));
        match at {
            [Some(x), Some(y), Some(z)] => {
                self.unplaced.remove(name);
                self.frames.insert(name.to_owned(), Pose::from_parts([x, y, z].into(), rotation));
            }
            _ => drop(self.unplaced.insert(name.to_owned(), rotation)),
        }
    }

    fn mode_of(&mut self, block: &Block) {
        for &code in &block.codes {
            self.machine.mode = match code {
                0 => Mode::Rapid,
                10 => Mode::Line,
                20 => Mode::Clockwise,
                30 => Mode::Anticlockwise,
                800 => Mode::Unset,
                _ => continue,
            };
        }
    }

    fn motion(&mut self, block: &Block) {
        self.mode_of(block);
        let unit = self.machine.unit;
        let absolute = self.machine.absolute;
        let say = |value: f64| if absolute { Say::To(value) } else { Say::By(value) };
        let mut words = Words { place: self.places(block).map(|place| place.map(say)), ..Words::default() };
        words.turn = ['A', 'B', 'C'].map(|letter| block.get(letter).map(say));
        let offsets = ['I', 'J', 'K'].map(|letter| block.get(letter).map(|value| value * unit));
        if !words.moves() && offsets.iter().all(Option::is_none) {
            return;
        }
        if matches!(self.machine.mode, Mode::Other(_)) {
            self.machine.elsewhere(block.text.clone(), true);
            return;
        }
        if matches!(self.machine.mode, Mode::Clockwise | Mode::Anticlockwise) {
            if let Some(turns) = block.get('P') {
                self.machine.note(format!("turns {turns}"));
            }
            words.circle = Some(match block.get('R') {
                Some(radius) => Circle::Radius(radius * unit),
                None => {
                    let at = self.machine.at;
                    let arcs_absolute = self.arcs_absolute;
                    Circle::Centre(std::array::from_fn(|axis| {
                        Some(if arcs_absolute { offsets[axis]? } else { at[axis]? + offsets[axis]? })
                    }))
                }
            });
        }
        if words.moves() {
            self.machine.go(words);
        }
    }
}
