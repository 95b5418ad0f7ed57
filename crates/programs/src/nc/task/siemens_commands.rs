//! Siemens: named commands.

use super::super::called::program_of;
use super::super::dialect::Dialect;
use super::super::modal_group::ModalGroup;
use super::super::modal_state::MotionMode;
use super::super::syntax::{Word, WordValue};
use super::super::token::Token;
use super::siemens_names::{is_cycle, is_harmless_call, is_keyword, is_measuring_cycle};
use super::{Block, Interpreter};
use crate::motion::Reason;

impl Interpreter<'_, '_> {
    /// Applies the named commands of a block. True if the block does nothing else.
    pub(super) fn named_commands(&mut self, block: &Block<'_>) -> bool {
        if self.dialect != Dialect::Siemens {
            return false;
        }
        for word in &block.words {
            if word.name.first() == Some(&b'$') && word.assigned {
                self.system_variable(word);
            }
        }
        if self.without_moving(|this| this.programmable_frame(block)) {
            return true;
        }
        let mut done = false;
        for index in 0..block.words.len() {
            let word = block.words[index];
            if word.name.len() < 2 || word.assigned || self.tree.kind(word.end - 1) == Some(Token::Colon) {
                continue;
            }
            let name = word.name.to_ascii_uppercase();
            if self.transformation_command(&name)
                || self.orientation_command(&name)
                || self.correction_command(&name)
            {
                continue;
            }
            match word.value {
                _ if name == b"CYCLE800" => {
                    self.swivel_cycle(block, &word);
                    done = true;
                }
                WordValue::Arguments { first, .. } if name == b"TRAILON" => {
                    self.couple_axis(self.tree.text(first + 1));
                }
                WordValue::Arguments { .. } if is_harmless_call(&name) => {}
                _ if is_measuring_cycle(&name) => {
                    self.list_left(block, &String::from_utf8_lossy(&name), Reason::Probe);
                    self.invalidate_by_probing();
                    done = true;
                }
                // POCKETP(30,10) calls the program of that name if there is one.
                WordValue::Arguments { .. } if is_cycle(&name) && !self.is_own_program(&name) => {
                    self.list_left(block, &String::from_utf8_lossy(&name), Reason::Cycle);
                    self.invalidate_position();
                    done = true;
                }
                _ if is_keyword(&name) => {}
                WordValue::Absent | WordValue::Arguments { .. } if self.is_call(block, index) => {
                    self.subprogram(block, &String::from_utf8_lossy(word.name));
                    done = true;
                }
                _ => {
                    self.list_unknown_word(block, &String::from_utf8_lossy(word.name), Reason::UnknownWord);
                    return true;
                }
            }
        }
        done
    }

    /// Whether a program of the files has a name.
    pub(super) fn is_own_program(&self, name: &[u8]) -> bool {
        self.scan.programs.contains(&program_of(&String::from_utf8_lossy(name)))
    }

    /// Transforms between programmed and machine axes. True if the command is one of them.
    fn transformation_command(&mut self, name: &[u8]) -> bool {
        match name {
            b"TRAORI" | b"TRAFOOF" => {
                self.switch_transform_in_place(ModalGroup::Kinematic, false);
                self.set_tcp_mode(name == b"TRAORI", false);
            }
            b"TRANSMIT" | b"TRACYL" | b"TRAANG" | b"TRACON" => {
                self.set_tcp_mode(false, false);
                self.switch_transform(ModalGroup::Kinematic, true);
            }
            b"DIAMON" | b"DIAM90" | b"DIAMOF" | b"DIAMCYCOF" | b"DIAMONA" | b"DIAM90A" | b"DIAMOFA" => {
                self.switch_transform_in_place(ModalGroup::Diameter, name != b"DIAMOF");
            }
            b"TOFRAME" | b"TOFRAMEX" | b"TOFRAMEY" | b"TOFRAMEZ" | b"TOROT" | b"TOROTX" | b"TOROTY"
            | b"TOROTZ" => {
                self.mark_position_used(super::EVERYWHERE);
                self.switch_transform(ModalGroup::ToolFrame, true);
            }
            b"TOROTOF" => self.switch_transform(ModalGroup::ToolFrame, false),
            b"PAROT" | b"PAROTOF" => self.switch_transform(ModalGroup::PartFrame, name == b"PAROT"),
            _ => return false,
        }
        true
    }

    /// Orientation and path commands. True if the command is one of them.
    fn orientation_command(&mut self, name: &[u8]) -> bool {
        match name {
            b"ORIMKS" | b"ORIWKS" => {
                self.switch_transform_in_place(ModalGroup::OrientationFrame, name == b"ORIMKS")
            }
            b"ORIRPY" | b"ORIEULER" | b"ORIVIRT1" | b"ORIVIRT2" | b"ORIRPY2" => {
                self.set_group(ModalGroup::RpyConvention, 1 + u64::from(name == b"ORIRPY"));
            }
            b"ORIROTA" => self.set_group(ModalGroup::SpinReference, 0),
            b"ORIROTR" | b"ORIROTT" | b"ORIROTC" => {
                self.set_group(ModalGroup::SpinReference, 1);
                self.state.orientation.spin = Err(Reason::OrientationUnknown);
            }
            // PTPG0 concerns G0 alone, whose path is not ours.
            b"PTP" | b"CP" => self.set_group(ModalGroup::PointToPoint, u64::from(name == b"PTP")),
            b"PTPG0" => self.set_group(ModalGroup::PointToPoint, 0),
            b"ORIPATH" | b"ORIPATHS" | b"ORIRESET" => self.state.invalidate_orientation(),
            b"CIP" | b"CT" | b"BSPLINE" | b"ASPLINE" | b"CSPLINE" | b"POLY" | b"INVCW" | b"INVCCW" => {
                self.state.mode = MotionMode::Unsupported(Reason::UnsupportedPath);
                self.state.starts_tangent = !matches!(name, b"CIP" | b"POLY" | b"INVCW" | b"INVCCW");
            }
            _ => return false,
        }
        true
    }

    /// Corrections of tool and axes by values that the text does not hold. True if the command is one of them.
    fn correction_command(&mut self, name: &[u8]) -> bool {
        match name {
            b"TOFF" | b"FTOCON" | b"FTOCOF" | b"TOFFON" | b"TOFFOF" | b"PUTFTOC" | b"PUTFTOCF"
            | b"TOWSTD" | b"TOWMCS" | b"TOWWCS" | b"TOWBCS" | b"TOWTCS" | b"TOWKCS" | b"TCOABS"
            | b"TCOFR" | b"TCOFRX" | b"TCOFRY" | b"TCOFRZ" => self.invalidate_active_tool(),
            b"GEOAX" => self.invalidate_offsets(),
            b"PRESETON" | b"PRESETONS" => {
                self.mark_position_used(super::EVERYWHERE);
                self.invalidate_offsets();
            }
            _ => return false,
        }
        true
    }

    /// `TRAILON(X,Y,1)` lets an axis follow another. Beside the arm that moves nothing of ours (`TRAILON(U,X)`); an axis of the arm then leaves the
    /// programmed path. Several may follow, so TRAILOF ends nothing for certain.
    fn couple_axis(&mut self, axis: &[u8]) {
        if !matches!(axis.to_ascii_uppercase()[..], [b'U' | b'V' | b'W' | b'S', ..]) {
            self.mark_position_used(super::EVERYWHERE);
            self.switch_transform(ModalGroup::AxisScaling, true);
        }
    }

    /// `CYCLE800(…)` tilts the plane; with empty brackets it cancels the tilt.
    fn swivel_cycle(&mut self, block: &Block<'_>, word: &Word<'_>) {
        let empty = matches!(word.value, WordValue::Arguments { first, end } if end == first + 2);
        if !empty {
            self.list_left(block, "CYCLE800", Reason::TiltsTool);
        }
        self.switch_transform(ModalGroup::TiltedPlane, !empty);
    }

    /// Whether an unknown name is a subprogram call: it comes first, alone or with a repeat count (P).
    fn is_call(&self, block: &Block<'_>, index: usize) -> bool {
        !block.flags.opaque
            && block.words.iter().enumerate().all(|(at, word)| {
                at == index || matches!(word.address(), Some(b'N' | b'P' | b'M' | b'F' | b'S' | b'T' | b'D'))
            })
    }
}
