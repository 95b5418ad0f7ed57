//! Modal G codes: motion, transforms, offsets, and how numbers are read.

use super::super::arc::Plane;
use super::super::dialect::Dialect;
use super::super::modal_state::{ModalGroup, MotionMode};
use super::super::syntax::Word;
use super::file_effects::name_key;
use super::siemens_names::code_name;
use super::{Block, Interpreter};
use crate::motion::Reason;

impl Interpreter<'_, '_> {
    /// Applies the modal G codes of a block. True if its axis words are not a motion.
    pub(super) fn modal_codes(&mut self, block: &Block<'_>) -> bool {
        self.state.exact_stop &= self.state.exact_stop_modal;
        // Of the numbered paths only the cubic spline (G5) continues in the direction of the motion before.
        if block
            .g
            .iter()
            .any(|code| matches!(code, 22..=24 | 32..=34 | 50..=53 | 62 | 320..=350 | 630 | 3310..=3360))
        {
            self.state.starts_tangent = block.g.contains(&50);
        }
        block.g.iter().any(|&code| {
            self.reading_code(block, code);
            self.path_control_code(code);
            self.transform_switch_code(block, code);
            self.motion_code(block, code)
                || self.transform_value_code(block, code)
                || self.offset_code(block, code)
        })
    }

    /// How the numbers of a block are read: plane, unit, distance mode.
    fn reading_code(&mut self, block: &Block<'_>, code: u32) {
        let siemens = self.dialect == Dialect::Siemens;
        match code {
            170 => self.set_plane(Plane::XY, code),
            180 => self.set_plane(Plane::ZX, code),
            190 => self.set_plane(Plane::YZ, code),
            200 if !siemens => self.unit(25.4),
            210 if !siemens => self.unit(1.0),
            700 | 710 if siemens || self.is_unit(block) => self.unit(if code == 700 { 25.4 } else { 1.0 }),
            7000 if siemens => self.unit(25.4),
            7100 if siemens => self.unit(1.0),
            900 | 910 => {
                self.state.absolute = code == 900;
                self.set_group(ModalGroup::DistanceMode, u64::from(code));
            }
            901 | 911 => {
                self.state.centre_absolute = code == 901;
                self.set_group(ModalGroup::ArcCentreMode, u64::from(self.state.centre_absolute));
            }
            _ => {}
        }
    }

    /// Path control: exact stop, radius compensation, feed mode.
    fn path_control_code(&mut self, code: u32) {
        match code {
            90 => self.state.exact_stop = true,
            600 | 610 | 611 | 6010..=6030 => {
                (self.state.exact_stop, self.state.exact_stop_modal) = (true, true)
            }
            640 | 6410..=6450 => (self.state.exact_stop, self.state.exact_stop_modal) = (false, false),
            400 | 410..=429 => {
                self.state.radius_compensation = code != 400;
                self.set_group(ModalGroup::RadiusCompensation, u64::from(self.state.radius_compensation));
            }
            930 | 950 => self.state.feed_per_minute = false,
            940 => self.state.feed_per_minute = true,
            _ => {}
        }
    }

    /// Transforms that a G code alone switches.
    fn transform_switch_code(&mut self, block: &Block<'_>, code: u32) {
        let siemens = self.dialect == Dialect::Siemens;
        let fanuc = self.dialect == Dialect::Fanuc;
        match code {
            70 if !siemens && !fanuc => self.switch_transform_in_place(ModalGroup::Diameter, true),
            80 if !fanuc && (block.p.is_none() || self.dialect == Dialect::LinuxCnc) => {
                self.switch_transform_in_place(ModalGroup::Diameter, false);
            }
            690 => self.switch_transform(ModalGroup::Rotation, false),
            _ if siemens => {}
            121 | 1120 => self.switch_transform(ModalGroup::PolarPath, true),
            131 | 1130 => self.switch_transform(ModalGroup::PolarPath, false),
            // Okuma: a work offset by its number.
            150 | 160 if block.h.is_some() => self.work_offset(code, block),
            150 | 160 => self.switch_transform(ModalGroup::Polar, code == 160),
            2540 | 2550 => self.switch_transform(ModalGroup::FixtureOffset, code == 2540),
            _ => {}
        }
    }

    /// Transforms whose values are words of the block. True if the axis words are not a motion.
    fn transform_value_code(&mut self, block: &Block<'_>, code: u32) -> bool {
        let siemens = self.dialect == Dialect::Siemens;
        let zero = |index: usize| self.literal(&block.words[index]) == Some(0.0);
        match code {
            500 if self.limits_spindle(block) => {}
            680..=689 => {
                if !siemens && block.axes.iter().flatten().count() < 2 {
                    self.mark_position_used(super::POSITION);
                }
                self.switch_transform(ModalGroup::Rotation, true);
            }
            _ if siemens => return false,
            71 | 1070 => {
                let ends =
                    block.abc.iter().chain(&block.axes).flatten().next().is_some_and(|&index| zero(index));
                self.switch_transform(ModalGroup::Cylinder, !ends);
            }
            500 | 510 => {
                if code == 510 && block.axes.contains(&None) {
                    // Omitted centre words are at the tool position.
                    self.mark_position_used(super::POSITION);
                }
                self.switch_transform(ModalGroup::Scaling, code == 510);
            }
            501 | 511 | 1000 | 1010 => self.switch_transform(ModalGroup::Mirror, matches!(code, 511 | 1010)),
            2680 | 2690 => self.switch_transform(ModalGroup::TiltedPlane, code == 2680),
            542 | 544 => {
                let ends = block.p.is_some_and(zero);
                self.switch_transform(ModalGroup::FixtureOffset, !ends);
            }
            _ => return false,
        }
        true
    }

    /// The motion group. True if the code is a mode switch and axis words only name axes.
    fn motion_code(&mut self, block: &Block<'_>, code: u32) -> bool {
        let siemens = self.dialect == Dialect::Siemens;
        let linux = self.dialect == Dialect::LinuxCnc;
        let fanuc = self.dialect == Dialect::Fanuc;
        self.state.mode = match code {
            0 => MotionMode::Rapid,
            10 => MotionMode::Linear,
            20 | 30 => MotionMode::Circular(code == 30),
            50 | 51 if !siemens && !linux && (fanuc || block.centre.iter().all(Option::is_none)) => {
                return true;
            }
            50 | 51 if !siemens => MotionMode::Unsupported(Reason::UnsupportedPath),
            350 | 630 if !siemens => return false,
            22..=24 | 32..=34 | 52 | 53 | 62 | 320 | 330 | 340 | 350 | 630 | 3310 | 3320 | 3350 | 3360 => {
                MotionMode::Unsupported(Reason::UnsupportedPath)
            }
            730..=790 | 810..=899 | 1530 | 1550 | 1610..=1690 | 1740 | 1840
                if !siemens && !self.reads_contour(block, code) =>
            {
                if !matches!(self.state.mode, MotionMode::Unsupported(Reason::Cycle)) {
                    self.state.mode_before_cycle = self.state.mode;
                }
                MotionMode::Unsupported(Reason::Cycle)
            }
            // Beside a motion code it only ends the cycle.
            800 if block.g.iter().any(|code| matches!(code, 0 | 10 | 20 | 30)) => return false,
            // On a Fanuc the motion mode before the cycle holds again, or, depending on the control, the rapid motion
            // of the cycle. LinuxCNC requires a new motion code.
            800 if fanuc && self.state.mode != MotionMode::Unsupported(Reason::Cycle) => return false,
            800 if fanuc && self.state.mode_before_cycle == MotionMode::Rapid => MotionMode::Rapid,
            800 => MotionMode::Unknown(Reason::NoMotionCode),
            _ => return false,
        };
        false
    }

    /// Tool lengths and work offsets. True if the axis words are their values.
    fn offset_code(&mut self, block: &Block<'_>, code: u32) -> bool {
        let siemens = self.dialect == Dialect::Siemens;
        match code {
            // One group on a control: G43, G44, G43.1, G43.4, G43.5, G49. G234 is of Haas.
            430 | 431 | 432 | 434 | 435 | 440 | 490 | 2340 if !siemens => {
                self.set_tcp_mode(matches!(code, 434 | 435 | 2340), code == 435);
                return self.length(block, code);
            }
            580 | 590 if siemens => {
                self.axial_shift(block, code == 580);
                return true;
            }
            540..=599 | 5000..=5999 | 1540 => self.work_offset(code, block),
            _ => {}
        }
        false
    }

    /// As [`Self::switch_transform`], for transforms that leave the axes and their values unchanged.
    pub(super) fn switch_transform_in_place(&mut self, group: ModalGroup, on: bool) {
        let was = self.state.is_transform_active(group);
        if was == on && self.state.unknown_reason(group.bit()).is_none() {
            self.set_group(group, u64::from(on));
        } else {
            self.switch_transform(group, on);
        }
    }

    /// Every work offset is or may be assigned an unknown value.
    pub(super) fn invalidate_offsets(&mut self) {
        self.state.assigned_offsets.invalidate();
        self.pass.effects.assigned.offsets |= self.is_conditional();
        self.pass.effects.assigned.rotary |= self.is_conditional();
        self.frame_index = None;
        self.invalidate_pose();
    }
    /// Whether G50 or G92 states a spindle speed limit, and not a position.
    pub(super) fn limits_spindle(&self, block: &Block<'_>) -> bool {
        !block.has_motion_words()
            && !block.other_axes
            && block.words.iter().any(|word| word.address() == Some(b'S'))
    }

    /// Sets the plane of arcs.
    pub(super) fn set_plane(&mut self, plane: Plane, code: u32) {
        self.state.plane = plane;
        self.set_group(ModalGroup::Plane, u64::from(code));
    }

    fn unit(&mut self, mm: f64) {
        self.state.unit_mm = mm;
        self.set_group(ModalGroup::Unit, if mm == 1.0 { 21 } else { 20 });
    }

    /// Whether G70 or G71 is a unit: on Fanuc, Haas and LinuxCNC they are cycles, with words of their own.
    pub(super) fn is_unit(&self, block: &Block<'_>) -> bool {
        let bare = |word: &Word<'_>| matches!(word.address(), Some(b'G' | b'N' | b'M' | b'S' | b'T' | b'F'));
        self.dialect == Dialect::Iso && block.words.iter().all(bare)
    }

    /// Whether this is a lathe cycle that reads a contour from P to Q, or a pattern of Haas: neither is modal.
    pub(super) fn reads_contour(&self, block: &Block<'_>, code: u32) -> bool {
        matches!(code, 700..=729) || matches!(code, 730 | 740..=769) && block.p.is_some() && block.q.is_some()
    }

    fn work_offset(&mut self, code: u32, block: &Block<'_>) {
        let mut name = code_name(code);
        let number = |at: Option<usize>| at.map(|index| self.literal(&block.words[index]));
        let number = match code {
            150 | 160 => number(block.h).map(|number| (" H", number)),
            541 | 1540 => number(block.p).map(|number| (" P", number)),
            // P means G54.1 P on some controls and nothing on others: the name is distinct, so that only a setup can
            // state it.
            540 if !self.p_belongs_elsewhere(block) => number(block.p).map(|number| (" P", number)),
            _ => None,
        };
        match number {
            Some((letter, Some(number))) => name += &format!("{letter}{}", number.round()),
            Some((letter, None)) => name += &format!("{letter}?"),
            None => {}
        }
        self.select_work_offset(name);
    }

    /// Whether P belongs to another word than the work offset: a call, a dwell, a cycle.
    fn p_belongs_elsewhere(&self, block: &Block<'_>) -> bool {
        matches!(self.dialect, Dialect::Siemens | Dialect::LinuxCnc)
            || block.m.iter().any(|m| matches!(m, 46 | 62..=68 | 96..=99 | 198))
            || block.g.iter().any(|g| matches!(g, 20 | 30 | 40 | 50..=52 | 80 | 100 | 510 | 470 | 650..=661 | 680..=689 | 700..=769 | 810..=899 | 1500))
    }

    /// Selects a work offset. The coordinates of the tool position change, and its orientation if the frames are
    /// rotated.
    pub(super) fn select_work_offset(&mut self, name: String) {
        let before = self.frame_value(&self.state.work_offset.clone());
        let pending = std::mem::take(&mut self.state.offset_pending);
        let unknown = self.state.unknown_reason(ModalGroup::WorkOffset.bit()).is_some();
        let changes = name != self.state.work_offset || pending || unknown;
        let after = self.frame_value(&name);
        self.set_group(ModalGroup::WorkOffset, name_key(&name));
        self.state.work_offset = name;
        self.frame_index = None;
        if !changes {
            return;
        }
        self.invalidate_position();
        let same_rotation = match (before, after) {
            (Ok(a), Ok(b)) => a.pose().rotation.angle_to(&b.pose().rotation) < 1e-9,
            _ => false,
        };
        if !same_rotation || pending || unknown {
            self.invalidate_pose();
        }
    }
}
