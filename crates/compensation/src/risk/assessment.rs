//! Risk assessment of a program before correction: where the path over each work object lies, how likely the correction of
//! each cut does harm, and the best registration of each part, the reference for the sigma of its shape.
//!
//! Everything follows from evenly spaced targets of the original program, with every joint at mid-play.

use std::collections::BTreeMap;

use nalgebra::{DVector, Matrix6xX};
use rayon::prelude::*;

use crate::condition::arm_conditions::ArmConditions;
use crate::cut::{CutsOf, is_one_part};
use crate::frames::frame_pair::ResolvedFrames;
use crate::plan::reason::OutcomeReason;
use crate::risk::beyond_noise::RegisteredErrors;
use crate::risk::cut_risk::{self, CutRisk, Judgement, PartRegistration, UnseenShare};
use crate::risk::fixtures;
use crate::risk::placement::{
    self, AssessedObject, AssessedTarget, ObjectPlacement, PathDeviation, Placement, PlacementChoice,
    assess_placement, evenly_spaced,
};
use crate::risk::probability::probability_of_harm;
use crate::risk::registration::Registration;
use crate::risk::remedy_search::{self, UnknownPlacement};
use crate::search_budget::MANY_MOTIONS;
use truegrind_arm::estimated::{CarriedFrame, Estimated, PosteriorComponent, RegisteredFrame};
use truegrind_math::se3::Pose;
use truegrind_programs::motion::Listing;

/// Assessment of a program.
#[derive(Debug, Clone, Default)]
pub(crate) struct Assessment {
    /// One entry per work object.
    pub(crate) placements: Vec<ObjectPlacement>,
    /// One entry per cut.
    pub(crate) cuts: Vec<CutRisk>,
    /// Of the cuts whose σ comes for the most part from what the measurement did not show, the largest σ.
    pub(crate) unseen: Option<UnseenShare>,
    /// Contribution of each cut to the program's probability of harm.
    shares: Vec<CutContribution>,
    /// Posterior of the arm's parameters.
    posterior: Vec<PosteriorComponent>,
    /// The cut of each motion, as an index into `cuts`; empty without cuts.
    cut_of: Vec<Option<u32>>,
    /// The part of each cut, as an index into `registered`.
    part_of_cut: Vec<usize>,
    /// The best registration of each part, in the base; absent where the robot holds it.
    registered: Vec<Option<RegisteredFrame>>,
    /// The same for work objects that were taught by other points than the first of their part, by work object.
    registered_apart: BTreeMap<u32, RegisteredFrame>,
}

impl Assessment {
    /// The motions that remain unmodified because correcting their cut is too likely to do harm.
    pub(crate) fn risky(&self) -> BTreeMap<u32, OutcomeReason> {
        let left = self.cuts.iter().filter(|cut| cut.left_for_risk);
        left.flat_map(|cut| {
            cut.motions
                .iter()
                .map(|motion| (*motion, OutcomeReason::Risk { chance: cut.probability_of_harm }))
        })
        .collect()
    }

    /// The reference frame of the shape of a motion's cut: it moves with the arm's parameters as the path over the part does.
    pub(crate) fn registered(&self, motion: u32, work_object: Option<u32>) -> Option<CarriedFrame<'_>> {
        let part = self.part_of_cut[self.cut_index(motion)?];
        let apart = work_object.and_then(|object| self.registered_apart.get(&object));
        apart.or(self.registered[part].as_ref()).map(RegisteredFrame::carried)
    }

    /// Sigma of the shape of a motion's cut (RMS, mm), for parts that the robot holds.
    pub(crate) fn sigma_of_cut_mm(&self, motion: u32) -> Option<f64> {
        let cut_index = self.cut_index(motion)?;
        let held = self.registered[self.part_of_cut[cut_index]].is_none();
        held.then_some(self.cuts[cut_index].shape_sigma_mm)
    }

    /// Whether only the shape of a motion's cut is corrected.
    pub(crate) fn shape_alone(&self, motion: u32) -> bool {
        self.cut_index(motion).is_some_and(|cut_index| self.cuts[cut_index].assessed == Placement::Shape)
    }

    /// Probability that correcting these cuts does harm, taken together; absent without any.
    pub(crate) fn probability_of_harm_of<'c>(
        &self,
        cuts: impl IntoIterator<Item = &'c CutRisk>,
    ) -> Option<f64> {
        let mut total = ProgramTotal::new(self.shares.first()?.toward.len());
        let places = cuts.into_iter().filter_map(|cut| self.cut_index(*cut.motions.first()?));
        places.filter_map(|cut_index| self.shares.get(cut_index)).for_each(|share| total.add(share));
        total.probability_of_harm(&self.posterior)
    }

    fn cut_index(&self, motion: u32) -> Option<usize> {
        self.cut_of.get(motion as usize).copied().flatten().map(|cut_index| cut_index as usize)
    }
}

/// The estimated arm, under each condition of the targets.
pub(crate) struct EstimateContext<'a, 'm> {
    pub(crate) conditions: &'a ArmConditions<'m>,
    pub(crate) knowledge: &'a Estimated,
    /// Posterior of its parameters.
    pub(crate) posterior: &'a [PosteriorComponent],
}

/// The sampled targets of each work object and of each cut, including the point where it begins.
pub(crate) struct AssessmentSample {
    /// The work object of each entry of the listing: the first of those that are placed as one.
    part_of: Vec<u32>,
    objects: Vec<(u32, Vec<u32>)>,
    cuts: Vec<(Vec<u32>, Vec<u32>)>,
}

impl AssessmentSample {
    /// From those motions for which `reached` holds. `part_of`: for each work object the first of those that are placed as one with it.
    pub(crate) fn of(
        listing: &Listing,
        cuts: &CutsOf,
        part_of: Vec<u32>,
        reached: impl Fn(usize) -> bool + Sync,
    ) -> Self {
        let motions = listing.motions.par_iter().with_min_len(MANY_MOTIONS).enumerate();
        let objects: Vec<Option<u32>> =
            motions.map(|(index, motion)| motion.work_object.filter(|_| reached(index))).collect();
        let mut of_object: BTreeMap<u32, [Vec<u32>; 2]> = BTreeMap::new();
        let mut in_cuts: Vec<(u32, u32)> = Vec::with_capacity(listing.motions.len());
        for (index, object) in (0_u32..).zip(objects) {
            let cut = cuts.path(index);
            in_cuts.extend(cut.map(|root| (root, index)));
            if let Some(object) = object {
                of_object.entry(part_of[object as usize]).or_default()[usize::from(cut.is_none())]
                    .push(index);
            }
        }
        // Air moves do not count where there are cuts.
        let objects = of_object.into_iter().map(|(object, [cuts, rest])| {
            (object, evenly_spaced(if cuts.is_empty() { &rest } else { &cuts }, placement::MAX_POINTS))
        });
        // Where a motion begins a cut: the end of one before it that is not part of the cut.
        let begin = |(root, index): (u32, u32)| {
            let motion = &listing.motions[index as usize];
            let before = motion.previous.filter(|before| cuts.path(*before) != Some(root))?;
            is_one_part(&listing.motions[before as usize], motion, &part_of).then_some(before)
        };
        // Stable: the motions of a cut stay in order.
        in_cuts.sort_by_key(|(root, _)| *root);
        let cuts = in_cuts.chunk_by(|a, b| a.0 == b.0).filter_map(|cut| {
            let all: Vec<u32> = cut.iter().map(|(_, index)| *index).collect();
            let begins = cut.iter().copied().filter_map(begin);
            let commanded: Vec<u32> =
                begins.chain(all.iter().copied()).filter(|m| reached(*m as usize)).collect();
            (!commanded.is_empty()).then(|| (all, evenly_spaced(&commanded, cut_risk::MAX_POINTS)))
        });
        Self { objects: objects.collect(), cuts: cuts.collect(), part_of }
    }
}

/// Assesses a program. `at`: the target at the end of a sampled motion. Work objects whose shape alone is
/// corrected are displaced in `list` to where the path really lies.
pub(crate) fn assess_program(
    listing: &Listing,
    chosen: AssessmentSample,
    at: &(dyn Fn(u32) -> Option<AssessedTarget> + Sync),
    list: &mut [ResolvedFrames],
    objects: &[u32],
    with: &EstimateContext<'_, '_>,
    choice: PlacementChoice,
) -> Assessment {
    let mut out = Assessment {
        posterior: with.posterior.to_vec(),
        cut_of: vec![None; listing.motions.len()],
        ..Assessment::default()
    };
    let mut parts: BTreeMap<u32, Part> = BTreeMap::new();
    for (object, motions) in &chosen.objects {
        let targets: Vec<AssessedTarget> = motions.iter().filter_map(|m| at(*m)).collect();
        let name = &listing.work_objects[*object as usize].name;
        let Some(mut found) = placed(name, &targets, list, with, choice) else { continue };
        found.placement.others = fixtures::other_names(listing, &chosen.part_of, *object);
        let first = targets[0].frames_index;
        let of_part = |of: &u32| chosen.part_of[*of as usize] == *object;
        if let Some(motion) = found.displacement {
            displace(list, objects, of_part, first, motion);
        }
        let part = out.register(found, list, objects, of_part, first);
        parts.insert(*object, part);
    }
    out.judge_cuts(listing, chosen, at, list, with, &parts, choice.max_risk);
    out
}

/// The placement of a part, with the measurement that would make its unknown position known.
fn placed(
    name: &str,
    targets: &[AssessedTarget],
    list: &[ResolvedFrames],
    with: &EstimateContext<'_, '_>,
    choice: PlacementChoice,
) -> Option<AssessedObject> {
    let EstimateContext { conditions, knowledge, posterior } = *with;
    let mut found = assess_placement(name, targets, list, conditions, knowledge, posterior, choice)?;
    if found.placement.applied == Placement::Shape && choice.remedies {
        let unknown = UnknownPlacement { targets, list, conditions, knowledge, max_risk: choice.max_risk };
        found.placement.remedy = remedy_search::remedy(&unknown);
    }
    Some(found)
}

/// Displaces the work objects of a part by a motion in the frame of entry `first`.
fn displace(
    list: &mut [ResolvedFrames],
    objects: &[u32],
    of_part: impl Fn(&u32) -> bool,
    first: usize,
    motion: Pose,
) {
    let reference = list[first].real.object;
    for (frames, _) in list.iter_mut().zip(objects).filter(|(_, of)| of_part(of)) {
        let object = &mut frames.real.object;
        *object = if *object == reference {
            reference * motion
        } else {
            reference * motion * reference.inverse() * *object
        };
    }
}

impl Assessment {
    /// Notes the placement of a part and the frames in the base that its shape refers to.
    fn register(
        &mut self,
        found: AssessedObject,
        list: &[ResolvedFrames],
        objects: &[u32],
        of_part: impl Fn(&u32) -> bool,
        first: usize,
    ) -> Part {
        let AssessedObject { placement, registration, twists, errors, .. } = found;
        let beyond_share = errors.as_ref().map_or(1.0, |errors| errors.share);
        let ResolvedFrames { real, carried, .. } = &list[first];
        let in_base = |carried: Option<&RegisteredFrame>| {
            let twists_of = twists.column_iter().map(|twist| twist.into_owned()).collect();
            let of_path =
                RegisteredFrame { origin_mm: registration.centre.coords, twists: twists_of, beyond_share };
            cut_risk::in_base(of_path, &real.object, carried)
        };
        self.registered.push((!real.holds_part).then(|| in_base(carried.as_ref())));
        let of_part = list.iter().zip(objects).filter(|(_, of)| of_part(of));
        let apart = of_part.filter(|(frames, _)| !real.holds_part && frames.carried != *carried);
        self.registered_apart.extend(apart.map(|(frames, of)| (*of, in_base(frames.carried.as_ref()))));
        let applied = placement.applied;
        self.placements.push(placement);
        let index = self.registered.len() - 1;
        Part { index, applied, reference: real.object, registration, twists, errors }
    }

    /// Judges the cuts over the parts.
    #[expect(clippy::too_many_arguments, reason = "the inputs of assess_program, with its parts")]
    fn judge_cuts(
        &mut self,
        listing: &Listing,
        chosen: AssessmentSample,
        at: &(dyn Fn(u32) -> Option<AssessedTarget> + Sync),
        list: &[ResolvedFrames],
        with: &EstimateContext<'_, '_>,
        parts: &BTreeMap<u32, Part>,
        max_risk: f64,
    ) {
        let EstimateContext { conditions, knowledge, posterior } = *with;
        let unseen = knowledge.unseen();
        let judge = |(motions, commanded): &(Vec<u32>, Vec<u32>)| {
            let targets: Vec<AssessedTarget> = commanded.iter().filter_map(|m| at(*m)).collect();
            let object = listing.motions[motions[0] as usize].work_object?;
            let Part { index, applied, reference, registration, twists, errors } =
                parts.get(&chosen.part_of[object as usize]).filter(|_| !targets.is_empty())?;
            let off = PathDeviation::of_part(&targets, reference, list, conditions, knowledge);
            let part = PartRegistration { registration, twists, errors: errors.as_ref() };
            let judgement = cut_risk::assess_cut(&off, &part, knowledge, &unseen, *applied);
            let weight = motions.len() as f64 / targets.len() as f64;
            let points = targets.len();
            let harm =
                probability_of_harm(judgement.square, &judgement.toward, judgement.beyond, posterior, points);
            Some((JudgedCut { placement: *applied, part: *index, points, weight }, judgement, harm))
        };
        let judged: Vec<Option<(JudgedCut, Judgement, f64)>> = chosen.cuts.par_iter().map(judge).collect();
        for ((motions, _), judged) in chosen.cuts.into_iter().zip(judged) {
            if let Some((cut, judgement, probability_of_harm)) = judged {
                self.add_cut(motions, &cut, judgement, probability_of_harm, max_risk);
            }
        }
    }

    fn add_cut(
        &mut self,
        motions: Vec<u32>,
        judged: &JudgedCut,
        judgement: Judgement,
        probability_of_harm: f64,
        max_risk: f64,
    ) {
        let left_for_risk = !(probability_of_harm <= max_risk);
        let cut_index = self.cuts.len() as u32;
        motions.iter().for_each(|m| self.cut_of[*m as usize] = Some(cut_index));
        let unseen = judgement.unseen;
        if !left_for_risk
            && unseen.prevails()
            && self.unseen.is_none_or(|worst| unseen.unseen_mm > worst.unseen_mm)
        {
            self.unseen = Some(unseen);
        }
        self.cuts.push(CutRisk {
            motions,
            assessed: judged.placement,
            deviation_mm: judgement.deviation_mm,
            sigma_mm: judgement.sigma_mm,
            shape_sigma_mm: judgement.shape_sigma_mm,
            probability_of_harm,
            left_for_risk,
            corrected: false,
        });
        self.part_of_cut.push(judged.part);
        self.shares.push(CutContribution {
            points: judged.weight * judged.points as f64,
            square: judged.weight * judgement.square,
            toward: judgement.toward * judged.weight,
            beyond: judgement.beyond.sqrt() * judged.weight,
        });
    }
}

/// How a cut was assessed.
struct JudgedCut {
    placement: Placement,
    /// Index into [`Assessment::registered`].
    part: usize,
    points: usize,
    /// Motions per sampled point.
    weight: f64,
}

/// A part, while its cuts are assessed.
struct Part {
    /// Index into [`Assessment::registered`].
    index: usize,
    applied: Placement,
    /// Its work object.
    reference: Pose,
    /// Registration of the path over it, in the work object.
    registration: Registration,
    /// Twists of the registration per unit of each parameter.
    twists: Matrix6xX<f64>,
    /// How the registration follows the errors beyond the noise.
    errors: Option<RegisteredErrors>,
}

/// Contribution of a cut: points, |d|² (mm²), Jᵀ d, and the standard deviation of d·e by the errors beyond the noise (mm²), which are
/// taken as alike in all cuts: never less than they are.
#[derive(Debug, Clone)]
struct CutContribution {
    points: f64,
    square: f64,
    toward: DVector<f64>,
    beyond: f64,
}

/// Sum over cuts.
struct ProgramTotal(CutContribution);

impl ProgramTotal {
    fn new(parameters: usize) -> Self {
        Self(CutContribution { points: 0.0, square: 0.0, toward: DVector::zeros(parameters), beyond: 0.0 })
    }

    fn add(&mut self, cut: &CutContribution) {
        self.0.points += cut.points;
        self.0.square += cut.square;
        self.0.toward += &cut.toward;
        self.0.beyond += cut.beyond;
    }

    fn probability_of_harm(&self, posterior: &[PosteriorComponent]) -> Option<f64> {
        let CutContribution { points, square, toward, beyond } = &self.0;
        let count = points.round() as usize;
        (*points > 0.0).then(|| probability_of_harm(*square, toward, beyond * beyond, posterior, count))
    }
}
