//! Siemens: commands with a name.

use super::super::dialect::Dialect;
use super::super::machine::{Group, Mode};
use super::super::syntax::{Belongs, Word};
use super::super::token::Token;
use super::names::{is_cycle, is_harmless_call, is_keyword};
use super::{Lister, Said};
use crate::motion::Reason;

impl Lister<'_, '_> {
    /// Commands with a name. True where nothing else is done in the block.
    pub(super) fn named_commands(&mut self, said: &Said<'_>) -> bool {
        if self.dialect != Dialect::Siemens {
            return false;
        }
        for word in &said.words {
            if word.name.first() == Some(&b'$') && word.assigned {
                self.system_variable(word);
            }
        }
        if self.programmable_frame(said) {
            return true;
        }
        let mut done = false;
        for index in 0..said.words.len() {
            let word = said.words[index];
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
            match word.belongs {
                _ if name == b"CYCLE800" => {
                    self.swivel_cycle(said, &word);
                    done = true;
                }
                Belongs::Arguments { .. } if is_harmless_call(&name) => {}
                Belongs::Arguments { .. } if is_cycle(&name) => {
                    self.left(said, &String::from_utf8_lossy(&name), Reason::Cycle);
                    self.lose_position();
                    done = true;
                }
                _ if is_keyword(&name) => {}
                Belongs::Nothing | Belongs::Arguments { .. } if self.is_call(said, index) => {
                    self.subprogram(said, &String::from_utf8_lossy(word.name));
                    done = true;
                }
                _ => {
                    self.deny(said, &String::from_utf8_lossy(word.name), Reason::UnknownWord);
                    return true;
                }
            }
        }
        done
    }

    /// What lies between the axes of the program and those of the machine. Whether the command is one of these.
    fn transformation_command(&mut self, name: &[u8]) -> bool {
        match name {
            b"TRAORI" | b"TRAFOOF" => {
                self.turn_only(Group::Kinematic, false);
                self.tip(name == b"TRAORI", false);
            }
            b"TRANSMIT" | b"TRACYL" | b"TRAANG" | b"TRACON" => {
                self.tip(false, false);
                self.turn(Group::Kinematic, true);
            }
            b"DIAMON" | b"DIAM90" | b"DIAMOF" | b"DIAMCYCOF" | b"DIAMONA" | b"DIAM90A" | b"DIAMOFA" => {
                self.turn_only(Group::Diameter, name != b"DIAMOF");
            }
            b"TOFRAME" | b"TOFRAMEX" | b"TOFRAMEY" | b"TOFRAMEZ" | b"TOROT" | b"TOROTX" | b"TOROTY"
            | b"TOROTZ" => {
                self.held_here(super::EVERYWHERE);
                self.turn(Group::ToolFrame, true);
            }
            b"TOROTOF" => self.turn(Group::ToolFrame, false),
            b"PAROT" | b"PAROTOF" => self.turn(Group::PartFrame, name == b"PAROT"),
            _ => return false,
        }
        true
    }

    /// How the tool is turned, and which way it goes. Whether the command is one of these.
    fn orientation_command(&mut self, name: &[u8]) -> bool {
        match name {
            b"ORIMKS" | b"ORIWKS" => self.turn_only(Group::OrientationFrame, name == b"ORIMKS"),
            b"ORIRPY" | b"ORIEULER" | b"ORIVIRT1" | b"ORIVIRT2" | b"ORIRPY2" => {
                self.state.rpy_stated = name == b"ORIRPY";
                self.set(Group::Rpy, 1 + u64::from(self.state.rpy_stated));
            }
            b"ORIROTA" => {
                self.state.spin_absolute = true;
                self.set(Group::Spin, 0);
            }
            b"ORIROTR" | b"ORIROTT" | b"ORIROTC" => {
                self.state.spin_absolute = false;
                self.set(Group::Spin, 1);
                self.state.spin = Err(Reason::OrientationUnknown);
            }
            b"ORIPATH" | b"ORIPATHS" | b"ORIRESET" => self.state.lose_orientation(),
            b"CIP" | b"CT" | b"BSPLINE" | b"ASPLINE" | b"CSPLINE" | b"POLY" | b"INVCW" | b"INVCCW" => {
                self.state.mode = Mode::Other(Reason::NotFollowed);
                self.state.tangent = !matches!(name, b"CIP" | b"POLY" | b"INVCW" | b"INVCCW");
            }
            _ => return false,
        }
        true
    }

    /// Corrections of the tool and of the axes to what the text does not tell. Whether the command is one of these.
    fn correction_command(&mut self, name: &[u8]) -> bool {
        match name {
            b"TOFF" | b"FTOCON" | b"FTOCOF" | b"TOFFON" | b"TOFFOF" | b"PUTFTOC" | b"PUTFTOCF"
            | b"TOWSTD" | b"TOWMCS" | b"TOWWCS" | b"TOWBCS" | b"TOWTCS" | b"TOWKCS" | b"TCOABS"
            | b"TCOFR" | b"TCOFRX" | b"TCOFRY" | b"TCOFRZ" => self.tool_assigned(),
            b"GEOAX" => self.frames_assigned(),
            b"PRESETON" | b"PRESETONS" => {
                self.held_here(super::EVERYWHERE);
                self.frames_assigned();
            }
            _ => return false,
        }
        true
    }

    /// `CYCLE800(…)` tilts the plane; with nothing in its brackets it ends that.
    fn swivel_cycle(&mut self, said: &Said<'_>, word: &Word<'_>) {
        let empty = matches!(word.belongs, Belongs::Arguments { first, end } if end == first + 2);
        if !empty {
            self.left(said, "CYCLE800", Reason::Cycle);
        }
        self.turn(Group::Swivel, !empty);
    }

    /// Whether a name that is not known calls a subprogram: it stands first, alone or with how often (P).
    fn is_call(&self, said: &Said<'_>, index: usize) -> bool {
        !said.opaque
            && said.words.iter().enumerate().all(|(at, word)| {
                at == index || matches!(word.address(), Some(b'N' | b'P' | b'M' | b'F' | b'S' | b'T' | b'D'))
            })
    }
}
