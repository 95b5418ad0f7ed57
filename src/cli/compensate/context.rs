//! What all programs of a `compensate` run share.

use truegrind::arm::estimated::Estimated;
use truegrind::compensation::cell::Cell;
use truegrind::compensation::options::Options;
use truegrind::compensation::risk::prepared_estimate::PreparedEstimate;
use truegrind::programs::nc::setup::Setup;
use truegrind::surfaces::SurfaceFile;

use super::arguments::Arguments;
use super::batch::ExitCriteria;

/// Arguments, model and cell of a run.
pub(super) struct CompensateContext<'a> {
    pub(super) arguments: &'a Arguments,
    /// `None` if the model is nominal: everything is listed, and no byte changes.
    pub(super) corrector: Option<Corrector<'a>>,
    pub(super) cell: Cell,
    pub(super) surface: Option<SurfaceFile>,
    pub(super) setup: Setup,
    pub(super) options: Options,
    /// Whether the process exits after this one program.
    pub(super) exits_after: bool,
}

impl CompensateContext<'_> {
    pub(super) fn exit_criteria(&self) -> ExitCriteria {
        ExitCriteria { nominal: self.corrector.is_none(), check: self.arguments.check }
    }
}

/// The estimated arm and its model file.
#[derive(Clone, Copy)]
pub(super) struct Corrector<'a> {
    pub(super) hash: &'a str,
    pub(super) model: &'a str,
    pub(super) arm: &'a Estimated,
    pub(super) prepared: &'a PreparedEstimate<'a>,
}
