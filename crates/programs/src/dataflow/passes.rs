//! The states at places to which control comes from elsewhere, in a text whose jumps are found only while it is read.
//!
//! Method: a pass over the text adds to each place what leads there; passes repeat until none adds anything. What they find then holds on
//! every path, whatever they began with and whether or not the transfer function is monotone. They begin with the guess that calls change
//! nothing, since otherwise each of many calls in a row would take a pass; what followed from wrong guesses is then dropped. Code that no
//! path reaches contributes nothing at first; once nothing changes, it is taken to run, in case it is reached after all.

use std::collections::{HashMap, HashSet};
use std::hash::Hash;

use super::lattice::Lattice;

/// How many passes a text gets: each level of calls and loops takes one.
const PASSES: usize = 9;
/// How many of them, behind the first, start anew from what the one before has found, if that rested on a guess.
const FRESH: usize = 2;

/// The states that arrive at each place of a text, from all passes so far.
#[derive(Debug)]
pub(crate) struct Arrivals<P, F> {
    arrived: HashMap<P, F>,
    /// Those of the pass before, where this one starts anew.
    before: HashMap<P, F>,
    /// Whether calls are guessed to change nothing where their end has not been reached, and whether one has been.
    guesses: bool,
    has_guessed: bool,
    /// Where something leads, and which places there are.
    targets: HashSet<P>,
    places: HashSet<P>,
    /// Whether this pass has added anything.
    has_grown: bool,
    /// Whether something may lead anywhere.
    is_open: bool,
    /// Whether code that no path reaches is taken to run.
    is_all_reached: bool,
    /// Whether this pass has found code that no path reaches.
    has_unreached: bool,
}

impl<P, F> Default for Arrivals<P, F> {
    fn default() -> Self {
        Arrivals {
            arrived: HashMap::new(),
            before: HashMap::new(),
            guesses: false,
            has_guessed: false,
            targets: HashSet::new(),
            places: HashSet::new(),
            has_grown: false,
            is_open: false,
            is_all_reached: false,
            has_unreached: false,
        }
    }
}

impl<P: Clone + Eq + Hash, F: Lattice + PartialEq> Arrivals<P, F> {
    /// A state leads to a place.
    pub(crate) fn add(&mut self, place: &P, state: &F) {
        match self.arrived.get_mut(place) {
            Some(all) => {
                let before = all.clone();
                all.join(state);
                self.has_grown |= *all != before;
            }
            None => {
                self.has_grown = true;
                self.arrived.insert(place.clone(), state.clone());
            }
        }
    }

    /// The text leads to this place, and must therefore have it.
    pub(crate) fn require(&mut self, place: P) {
        self.targets.insert(place);
    }

    /// Whether something leads to a place.
    pub(crate) fn is_required(&self, place: &P) -> bool {
        self.targets.contains(place)
    }

    /// Whether a place has been read.
    pub(crate) fn is_read(&self, place: &P) -> bool {
        self.places.contains(place)
    }

    /// The state that arrives at a place of the text; `None`: no path is known that leads there.
    pub(crate) fn at(&mut self, place: &P) -> Option<F> {
        self.places.insert(place.clone());
        self.arrived.get(place).or_else(|| self.before.get(place)).cloned()
    }

    /// Whether a call is to be guessed to change nothing, since no pass has reached the `place` where it ends.
    pub(crate) fn guess(&mut self, place: &P) -> bool {
        let guesses = self.guesses && !self.arrived.contains_key(place);
        self.has_guessed |= guesses;
        guesses
    }

    /// Control may lead to a place that the text does not show.
    pub(crate) fn lead_anywhere(&mut self) {
        self.is_open = true;
    }

    /// What has been found outside the states asks for another pass.
    pub(crate) fn ask_for_pass(&mut self) {
        self.has_grown = true;
    }

    /// No path reaches a statement. Whether it is taken to run all the same.
    pub(crate) fn find_unreached(&mut self) -> bool {
        self.has_unreached = true;
        self.is_all_reached
    }

    fn leads_elsewhere(&self) -> bool {
        self.is_open || self.targets.iter().any(|place| !self.places.contains(place))
    }

    /// Prepares pass `number`. Whether it starts anew from what the one before has found.
    fn prepare(&mut self, number: usize, fresh: &mut std::ops::Range<usize>) -> bool {
        self.guesses = number == 0;
        let is_fresh = number > 0 && self.has_guessed && fresh.next().is_some();
        self.before = if is_fresh { std::mem::take(&mut self.arrived) } else { HashMap::new() };
        (self.has_grown, self.has_unreached) = (false, false);
        is_fresh
    }
}

/// Has `pass` read a text until its [`Arrivals`] no longer change. A pass is false where the text ends within a structure. False where
/// the paths do not follow from the text, or not within [`PASSES`]; there are no arrivals then.
pub(crate) fn read_until_stable<R, P: Clone + Eq + Hash, F: Lattice + PartialEq>(
    reader: &mut R,
    arrivals: impl Fn(&mut R) -> &mut Option<Box<Arrivals<P, F>>>,
    mut pass: impl FnMut(&mut R) -> bool,
) -> bool {
    *arrivals(reader) = Some(Box::default());
    let mut fresh = 0..FRESH;
    for number in 0..PASSES {
        let Some(is_fresh) = arrivals(reader).as_mut().map(|found| found.prepare(number, &mut fresh)) else {
            return false;
        };
        let is_complete = pass(reader);
        let Some(found) = arrivals(reader).as_mut().filter(|found| is_complete && !found.leads_elsewhere())
        else {
            break;
        };
        if is_fresh {
            if found.arrived == found.before {
                fresh = 0..0;
            }
            continue;
        }
        if found.has_grown {
            continue;
        }
        if found.is_all_reached || !found.has_unreached {
            return true;
        }
        found.is_all_reached = true;
    }
    *arrivals(reader) = None;
    false
}
