//! Arcs, as all controls write them alike.

use super::Maker;

const LETTERS: [&str; 3] = ["X", "Y", "Z"];

/// An arc of a control that has G2, G3 and planes.
pub(super) struct Round {
    plane: &'static str,
    /// The axes of its plane, from 0.
    pub(super) axes: [usize; 2],
    /// Where it begins (mm).
    pub(super) from: [f64; 3],
    /// Its end and its centre, both counted from its begin (mm).
    end: [f64; 2],
    pub(super) centre: [f64; 2],
    anticlockwise: bool,
}

impl Round {
    /// The block that goes to its begin, and the words that go to its end.
    pub(super) fn words(&self, m: &mut Maker) -> (String, Vec<String>) {
        let word = if self.anticlockwise { "G3" } else { "G2" };
        let mut begin = vec!["G1".to_owned()];
        let mut block = match self.plane {
            "G17" => vec![word.to_owned()],
            plane => vec![plane.to_owned(), word.to_owned()],
        };
        for (side, axis) in self.axes.into_iter().enumerate() {
            begin.push(m.axis(LETTERS[axis], self.from[axis]));
            block.push(m.axis(LETTERS[axis], self.from[axis] + self.end[side]));
        }
        (begin.join(" "), block)
    }

    /// The word of the axis across its plane: it rises.
    pub(super) fn rise(&self, m: &mut Maker) -> String {
        let across = 3 - self.axes[0] - self.axes[1];
        m.axis(LETTERS[across], self.from[across])
    }

    /// Its radius (mm), below zero where it goes more than half round.
    pub(super) fn radius(&self) -> f64 {
        radius(self.end, self.centre, self.anticlockwise)
    }

    /// The angle that it opens (°).
    pub(super) fn opening(&self) -> f64 {
        let radius = self.radius();
        let angle = (self.end[0].hypot(self.end[1]) / 2.0 / radius.abs()).min(1.0).asin().to_degrees() * 2.0;
        if radius < 0.0 { 360.0 - angle } else { angle }
    }

    /// Its blocks, and the plane that holds elsewhere.
    pub(super) fn blocks(&self, begin: String, block: &[String]) -> Vec<String> {
        let mut out = vec![begin, block.join(" ")];
        if self.plane != "G17" {
            out.push("G17".to_owned());
        }
        out
    }
}

/// The radius of an arc (mm), below zero where it goes more than half round. Its end and centre are counted from its begin.
pub(super) fn radius(end: [f64; 2], centre: [f64; 2], anticlockwise: bool) -> f64 {
    let radius = centre[0].hypot(centre[1]);
    let half = (end[0].hypot(end[1]) - 2.0 * radius).abs() <= 1e-6;
    let side = end[0] * centre[1] - end[1] * centre[0];
    if !half && (side > 0.0) != anticlockwise { -radius } else { radius }
}

impl Maker {
    /// A quarter, half or odd arc in the plane of two axes (0 to 2) from a place: its end and its centre, both counted
    /// from its start, and whether it goes anticlockwise.
    pub(super) fn bow(&mut self) -> ([f64; 2], [f64; 2], bool) {
        let radius = self.pick(&[5.0, 10.0, 20.0, 12.5]);
        let from = self.whole(0, 7) * 45.0;
        let sweep = self.pick(&[90.0, 90.0, 180.0, 45.0, 270.0, -90.0, -90.0, -180.0, -30.0]);
        let spoke = |degrees: f64| {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            [radius * cos, radius * sin]
        };
        let (start, end) = (spoke(from), spoke(from + sweep));
        ([end[0] - start[0], end[1] - start[1]], [-start[0], -start[1]], sweep > 0.0)
    }

    /// Such an arc in one of the three planes.
    pub(super) fn round(&mut self) -> Round {
        let (end, centre, anticlockwise) = self.bow();
        let from = self.place();
        let (plane, axes) = self.pick(&[("G17", [0, 1]), ("G17", [0, 1]), ("G18", [2, 0]), ("G19", [1, 2])]);
        Round { plane, axes, from, end, centre, anticlockwise }
    }
}
