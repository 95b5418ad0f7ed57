//! How a controller counts the joints: some makers turn an angle's sign, and some count the third joint from the horizontal, so that
//! the second takes it along.

/// The angles about the axes of the links, of those that the controller counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointMap {
    /// 1 or −1 for each joint.
    pub sign: [f64; 6],
    /// How many turns the third axis makes for one of the second joint: −1, 0 or 1.
    pub coupling: f64,
}

impl JointMap {
    /// Angles as counted.
    pub const PLAIN: Self = Self { sign: [1.0; 6], coupling: 0.0 };

    /// About the axes, of counted angles.
    pub fn axes(&self, counted: &[f64; 6]) -> [f64; 6] {
        let mut out = std::array::from_fn(|j| self.sign[j] * counted[j]);
        out[2] += self.coupling * counted[1];
        out
    }

    /// Counted, of angles about the axes.
    pub fn counted(&self, axes: &[f64; 6]) -> [f64; 6] {
        let mut out = std::array::from_fn(|j| self.sign[j] * axes[j]);
        out[2] -= self.sign[2] * self.coupling * out[1];
        out
    }

    /// The range of counted angles in which the axes go through all of theirs: as wide as the second joint makes it.
    pub fn counted_range(&self, min: &[f64; 6], max: &[f64; 6]) -> [[f64; 6]; 2] {
        let ends = |j: usize| [self.sign[j] * min[j], self.sign[j] * max[j]];
        let mut low: [f64; 6] = std::array::from_fn(|j| ends(j)[0].min(ends(j)[1]));
        let mut high: [f64; 6] = std::array::from_fn(|j| ends(j)[0].max(ends(j)[1]));
        let taken = [low[1], high[1]].map(|angle| self.sign[2] * self.coupling * angle);
        low[2] -= taken[0].max(taken[1]);
        high[2] -= taken[0].min(taken[1]);
        [low, high]
    }

    /// One row for each axis, as in a model file.
    pub fn rows(&self) -> [[f64; 6]; 6] {
        let row = |i: usize| {
            std::array::from_fn(|j| match (i, j) {
                _ if i == j => self.sign[i],
                (2, 1) => self.coupling,
                _ => 0.0,
            })
        };
        std::array::from_fn(row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counted_angles_lead_back_and_their_range_holds_all() {
        for coupling in [-1.0, 0.0, 1.0] {
            let map = JointMap { sign: [1.0, -1.0, -1.0, 1.0, 1.0, -1.0], coupling };
            let axes = [0.1, 0.7, -0.4, 0.3, 1.1, -2.0];
            let counted = map.counted(&axes);
            let again = map.axes(&counted);
            assert!((0..6).all(|j| (again[j] - axes[j]).abs() < 1e-15), "{again:?}");
            let product = map.rows().map(|row| row.iter().zip(&counted).map(|(a, b)| a * b).sum::<f64>());
            assert!((0..6).all(|j| (product[j] - axes[j]).abs() < 1e-15), "{product:?}");
            let (min, max) = ([-1.0; 6], [2.0; 6]);
            let [low, high] = map.counted_range(&min, &max);
            for corner in 0..64 {
                let end = std::array::from_fn(|j| if corner >> j & 1 == 0 { min[j] } else { max[j] });
                let counted = map.counted(&end);
                assert!((0..6).all(|j| counted[j] >= low[j] - 1e-12 && counted[j] <= high[j] + 1e-12));
            }
        }
    }
}
