//! What runs along an axis.

/// An axis: what runs along it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// What it shows.
    pub label: String,
    /// Unit; empty for none.
    pub unit: String,
    /// Logarithmic; values that are not positive are then left out.
    pub log: bool,
    /// Ends; chosen from the data where absent. What lies beyond is cut off.
    pub range: Option<[f64; 2]>,
}

impl Axis {
    /// A linear axis with ends from the data.
    pub fn new(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { label: label.into(), unit: unit.into(), log: false, range: None }
    }

    /// A logarithmic axis with ends from the data.
    pub fn log(label: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { log: true, ..Self::new(label, unit) }
    }

    /// Label with unit, `RMSE (mm)`.
    pub fn text(&self) -> String {
        match (self.label.as_str(), self.unit.as_str()) {
            (label, "") => label.to_owned(),
            ("", unit) => format!("[{unit}]"),
            (label, unit) => format!("{label} [{unit}]"),
        }
    }
}
