//! A parameter of an effect by name.

/// A parameter of an effect as the tables show it.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectParameter {
    /// Name within the effect.
    pub name: &'static str,
    /// Unit as printed.
    pub unit: &'static str,
    /// Present value.
    pub value: f64,
}
