//! How warm an arm is: two bodies, one quick and one slow, that follow whether the arm works.

/// A course of warmth from 0, cold, to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Warmth {
    /// Time constants of the two bodies (h).
    pub hours: [f64; 2],
    /// Share of the quick one.
    pub quick: f64,
    /// When the arm stood still (h).
    pub pause: Option<[f64; 2]>,
}

impl Warmth {
    /// At a time (h).
    pub fn at(&self, time: f64) -> f64 {
        let body = |constant: f64| {
            let warmed = |from: f64, hours: f64| 1.0 - (1.0 - from) * (-hours / constant).exp();
            match self.pause {
                Some([stop, go]) if time > stop => {
                    let cooled = warmed(0.0, stop) * (-(time.min(go) - stop) / constant).exp();
                    if time > go { warmed(cooled, time - go) } else { cooled }
                }
                _ => warmed(0.0, time),
            }
        };
        self.quick * body(self.hours[0]) + (1.0 - self.quick) * body(self.hours[1])
    }
}
