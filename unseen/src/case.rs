//! One run: an arm, a sensor, a walk, and what is wrong.

use rand::{Rng, RngExt};

use crate::arms::{Arm, SHEETS, Sheet};
use crate::designs::{Design, Visit, Walk};
use crate::draw::{Purpose, generator, normal, one};
use crate::hidden::{Hidden, Scene, Shape};
use crate::sensors::{self, Kind as Measures, Reading, Sensor, white};
use crate::table::Line;
use crate::truth::Kind;
use crate::worth::{Sized, sized};

/// Fresh series by which a held-out error is judged.
pub const FRESH_SERIES: usize = 8;

/// Clean poses on which a model of the arm is judged.
pub const CLEAN: usize = 300;

/// What is drawn and how large it may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Rows at most.
    pub rows: usize,
    /// Only this design.
    pub design: Option<Design>,
}

impl Default for Limits {
    fn default() -> Self {
        Self { rows: 2500, design: None }
    }
}

/// A run.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// The seed of all runs.
    pub seed: u64,
    /// Number of the run among those of its kind.
    pub run: u64,
    /// Draws before this one that showed too little.
    pub attempt: u64,
    /// The data sheet.
    pub sheet: &'static Sheet,
    /// The arm as built.
    pub arm: Arm,
    /// The sensor.
    pub sensor: Sensor,
    /// The measured visits.
    pub walk: Walk,
    /// What is wrong.
    pub hidden: Hidden,
    /// What it is worth, in standard deviations of the noise.
    pub worth: f64,
}

/// Draws of a case until its effect shows; one of the first dozen does unless the design is given.
const ATTEMPTS: u64 = 400;

impl Case {
    /// Draws run `run` of a kind. What it is depends on nothing but seed, kind, run and limits.
    ///
    /// # Panics
    ///
    /// If the design that `limits` ask for does not show such an effect: a raster hardly turns a target nest.
    pub fn draw(seed: u64, kind: Kind, run: u64, limits: Limits) -> Self {
        (0..ATTEMPTS).find_map(|attempt| Self::attempt(seed, kind, run, attempt, limits)).unwrap_or_else(
            || panic!("{kind:?}, run {run}: none of {ATTEMPTS} draws shows it with {limits:?}"),
        )
    }

    fn attempt(seed: u64, kind: Kind, run: u64, attempt: u64, limits: Limits) -> Option<Self> {
        let rng = |purpose| generator(seed, kind as u64, run, attempt, purpose);
        let mut setting = rng(Purpose::Setting);
        let sheet = &SHEETS[setting.random_range(0..SHEETS.len())];
        let measures = drawn_sensor(kind, &mut setting);
        let design = limits.design.unwrap_or_else(|| drawn_design(kind, &mut setting));
        let ideal = Sensor::draw(sheet, measures, kind == Kind::Refraction, &mut setting);
        let arm = sheet.built(&mut rng(Purpose::Arm));
        let walk = Walk::draw(sheet, design, limits.rows, &mut rng(Purpose::Poses));
        let scene = Scene { sheet, arm: &arm, sensor: &ideal, walk: &walk };
        let mut effect = rng(Purpose::Effect);
        let shape = Hidden::draw(kind, &scene, &mut effect);
        let Sized { hidden, sigma_mm, worth } = sized(&scene, &shape, &mut effect)?;
        let sensor = Sensor { sigma_mm, ..ideal };
        Some(Self { seed, run, attempt, sheet, arm, sensor, walk, hidden, worth })
    }

    /// What is wrong.
    pub fn kind(&self) -> Kind {
        self.hidden.truth.kind
    }

    /// Everything that is the same for all visits.
    pub fn scene(&self) -> Scene<'_> {
        Scene { sheet: self.sheet, arm: &self.arm, sensor: &self.sensor, walk: &self.walk }
    }

    /// A generator of this run.
    pub fn generator(&self, purpose: Purpose) -> impl Rng + use<> {
        generator(self.seed, self.kind() as u64, self.run, self.attempt, purpose)
    }

    /// The rows of the file.
    pub fn lines(&self) -> Vec<Line> {
        self.read(&self.walk.visits, &mut self.generator(Purpose::Noise))
    }

    /// [`FRESH_SERIES`] fresh series of the same measurement, each with as many rows as the file, and what leads to them.
    pub fn fresh(&self) -> Vec<(Vec<Visit>, Vec<Line>)> {
        let mut rng = self.generator(Purpose::Fresh);
        let series = (0..FRESH_SERIES).map(|_| {
            let visits = self.walk.fresh(self.sheet, self.walk.visits.len(), &mut rng);
            let lines = self.read(&visits, &mut rng);
            // A cable has no way round its pulley to a target that is nearer than its rim.
            visits
                .into_iter()
                .zip(lines)
                .filter(|(_, line)| line.reading.lengths().iter().all(|l| l.is_finite()))
                .unzip()
        });
        series.collect()
    }

    /// Fresh visits, without any sensor.
    pub fn clean(&self) -> Vec<Visit> {
        let count = CLEAN * self.walk.repeats;
        let visits = self.walk.fresh(self.sheet, count, &mut self.generator(Purpose::Clean));
        visits.into_iter().filter(|visit| visit.counted && visit.repeat == 0).collect()
    }

    /// Exact readings of visits, with what is wrong.
    pub fn exact(&self, visits: &[Visit]) -> Vec<Reading> {
        visits.iter().map(|visit| self.hidden.reading(&self.scene(), visit)).collect()
    }

    fn read(&self, visits: &[Visit], rng: &mut impl Rng) -> Vec<Line> {
        let mut remembered: [f64; 6] = std::array::from_fn(|_| normal(rng));
        let exact = self.exact(visits);
        visits
            .iter()
            .zip(exact)
            .map(|(visit, exact)| {
                let mut noise = white(rng);
                if let Shape::Correlated(keep) = self.hidden.shape {
                    for (noise, state) in noise.iter_mut().zip(&mut remembered) {
                        // From one counted row to the next, as in the file, whatever leads there.
                        if visit.counted {
                            *state = keep * *state + (1.0 - keep * keep).sqrt() * normal(rng);
                        }
                        *noise += self.hidden.size * *state;
                    }
                }
                Line::new(visit, self.sensor.disturbed(&exact, &noise))
            })
            .collect()
    }
}

fn drawn_sensor(kind: Kind, rng: &mut impl Rng) -> Measures {
    let [cable, tracker] = kind.sensors();
    loop {
        let measures = sensors::any(rng);
        if if measures == Measures::Cable { cable } else { tracker } {
            return measures;
        }
    }
}

fn drawn_design(kind: Kind, rng: &mut impl Rng) -> Design {
    use Design::{Curve, Grid, Random, Raster, Repeats};
    match kind {
        Kind::Latency => one(rng, &[Curve, Curve, Raster]),
        // On a path every step is as small as the one before.
        Kind::Unsettled => one(rng, &[Random, Random, Grid, Repeats]),
        _ => one(rng, &[Random, Random, Random, Random, Grid, Repeats, Repeats, Curve, Curve, Raster]),
    }
}
