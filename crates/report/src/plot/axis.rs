//! Description of an axis.

/// An axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// Label.
    pub label: String,
    /// Unit; empty for none.
    pub unit: String,
    /// Logarithmic; values that are not positive are then omitted.
    pub log: bool,
    /// Range; by default that of the data. Values outside are clipped.
    pub range: Option<[f64; 2]>,
}

impl Axis {
    /// A linear axis with the range of the data.
    pub fn new(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { label: label.into(), unit: unit.into(), log: false, range: None }
    }

    /// A logarithmic axis with the range of the data.
    pub fn log(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { log: true, ..Self::new(label, unit) }
    }

    /// Label with unit, `RMSE [mm]`.
    pub fn text(&self) -> String {
        match (self.label.as_str(), self.unit.as_str()) {
            (label, "") => label.to_owned(),
            ("", unit) => format!("[{unit}]"),
            (label, unit) => format!("{label} [{unit}]"),
        }
    }
}
