//! A problem written as one formula per row; its Jacobian is exact, by forward differentiation.

use std::ops::{Add, Div, Mul, Neg, Range, Sub};

use truegrind_estimation::problem::{Prior, Problem};

/// A number with its derivative with respect to one parameter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Dual {
    pub(crate) value: f64,
    pub(crate) slope: f64,
}

impl Dual {
    fn chain(self, value: f64, slope: f64) -> Self {
        Self { value, slope: slope * self.slope }
    }
    pub(crate) fn exp(self) -> Self {
        self.chain(self.value.exp(), self.value.exp())
    }
    pub(crate) fn sqrt(self) -> Self {
        self.chain(self.value.sqrt(), 0.5 / self.value.sqrt())
    }
    pub(crate) fn atan(self) -> Self {
        self.chain(self.value.atan(), 1.0 / (1.0 + self.value * self.value))
    }
    pub(crate) fn sin(self) -> Self {
        self.chain(self.value.sin(), self.value.cos())
    }
    pub(crate) fn powi(self, e: i32) -> Self {
        self.chain(self.value.powi(e), f64::from(e) * self.value.powi(e - 1))
    }
    pub(crate) fn pow(self, e: Self) -> Self {
        let value = self.value.powf(e.value);
        Self { value, slope: value * (e.slope * self.value.ln() + e.value * self.slope / self.value) }
    }
}

impl From<f64> for Dual {
    fn from(value: f64) -> Self {
        Self { value, slope: 0.0 }
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident, $rule:expr) => {
        impl $trait for Dual {
            type Output = Dual;
            fn $name(self, other: Dual) -> Dual {
                let rule: fn(Dual, Dual) -> (f64, f64) = $rule;
                let (value, slope) = rule(self, other);
                Dual { value, slope }
            }
        }
        impl $trait<f64> for Dual {
            type Output = Dual;
            fn $name(self, other: f64) -> Dual {
                self.$name(Dual::from(other))
            }
        }
        impl $trait<Dual> for f64 {
            type Output = Dual;
            fn $name(self, other: Dual) -> Dual {
                Dual::from(self).$name(other)
            }
        }
    };
}
operator!(Add, add, |a, b| (a.value + b.value, a.slope + b.slope));
operator!(Sub, sub, |a, b| (a.value - b.value, a.slope - b.slope));
operator!(Mul, mul, |a, b| (a.value * b.value, a.slope * b.value + a.value * b.slope));
operator!(Div, div, |a, b| (
    a.value / b.value,
    (a.slope * b.value - a.value * b.slope) / (b.value * b.value)
));

impl Neg for Dual {
    type Output = Dual;
    fn neg(self) -> Dual {
        0.0 - self
    }
}

/// Rows given by a formula.
pub(crate) struct Rows<F> {
    pub(crate) parameters: usize,
    pub(crate) rows: usize,
    pub(crate) per_observation: usize,
    pub(crate) priors: Vec<Prior>,
    pub(crate) formula: F,
}

/// Rows without priors.
pub(crate) fn rows<F: Fn(&[Dual], usize) -> Dual + Sync>(
    parameters: usize,
    rows: usize,
    formula: F,
) -> Rows<F> {
    Rows { parameters, rows, per_observation: 1, priors: Vec::new(), formula }
}

impl<F: Fn(&[Dual], usize) -> Dual + Sync> Problem for Rows<F> {
    fn parameters(&self) -> usize {
        self.parameters
    }
    fn rows(&self) -> usize {
        self.rows
    }
    fn rows_per_observation(&self) -> usize {
        self.per_observation
    }
    fn priors(&self) -> &[Prior] {
        &self.priors
    }
    fn residuals(&self, x: &[f64], rows: Range<usize>, out: &mut [f64]) {
        let x: Vec<Dual> = x.iter().copied().map(Dual::from).collect();
        for (out, row) in out.iter_mut().zip(rows) {
            *out = (self.formula)(&x, row).value;
        }
    }
    fn jacobian(&self, x: &[f64], rows: Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, rows.clone(), residuals);
        let mut x: Vec<Dual> = x.iter().copied().map(Dual::from).collect();
        for k in 0..x.len() {
            x[k].slope = 1.0;
            for (i, row) in rows.clone().enumerate() {
                jacobian[k * rows.len() + i] = (self.formula)(&x, row).slope;
            }
            x[k].slope = 0.0;
        }
    }
}
