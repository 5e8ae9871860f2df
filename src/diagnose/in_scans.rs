//! An effect on some of several scans that are diagnosed together, or on a place of the target that all of them see.

use std::collections::BTreeMap;

use super::views::Views;
use crate::brdf::Brdf;
use crate::effects::{
    About, Effect, Level, MeanEcho, Place, Receiver, Shot, Stage, Survey, Twist, family,
};
use crate::frames::{Global, Pose};

/// An effect with the scans on which it acts.
pub(super) struct InScans<'a> {
    effect: &'a dyn Effect,
    /// All for an empty list.
    scans: Vec<u16>,
    views: &'a Views<'a>,
    /// Whether it belongs to a place of the target, which is where the first scan sees it.
    is_placed: bool,
}

/// Every member of the families of these effects for the scans of a problem. What belongs to the target acts on all scans.
/// A pose and a motion belong to one scan each, and what belongs to an instrument to all its scans. What changes the law of
/// received powers is taken as common to all.
pub(super) fn for_scans<'a>(effects: &[&'a dyn Effect], views: &'a Views<'a>) -> Vec<InScans<'a>> {
    let instruments = views.instruments();
    let has_several = instruments.iter().any(|&first| first != 0);
    let mut all = Vec::new();
    for effect in effects.iter().flat_map(|effect| family(*effect)) {
        let groups = if effect.moves() {
            (0..instruments.len()).map(|scan| vec![scan as u16]).collect()
        } else if effect.level() == Level::Instrument && has_several && !receives(effect, views) {
            of_instruments(&instruments)
        } else {
            vec![Vec::new()]
        };
        all.extend(groups.into_iter().map(|scans| InScans::new(effect, scans, views)));
    }
    all
}

/// The scans of each instrument.
fn of_instruments(instruments: &[usize]) -> Vec<Vec<u16>> {
    let mut groups: BTreeMap<usize, Vec<u16>> = BTreeMap::new();
    for (scan, first) in instruments.iter().enumerate() {
        groups.entry(*first).or_default().push(scan as u16);
    }
    groups.into_values().collect()
}

/// Whether an effect changes the law of received powers at any of its starts.
fn receives(effect: &dyn Effect, views: &Views) -> bool {
    let receiver = Receiver { looks: 4.0, ..Receiver::LINEAR };
    let starts = effect.starts(&views.stages[0], &[]);
    starts.iter().any(|start| effect.receive(start, receiver) != receiver)
}

impl<'a> InScans<'a> {
    /// An effect on these scans; on all for an empty list.
    pub fn new(effect: &'a dyn Effect, scans: Vec<u16>, views: &'a Views<'a>) -> InScans<'a> {
        let absent: Vec<f64> = effect.parameters().iter().map(|known| known.absent).collect();
        let is_placed = scans.is_empty() && effect.place(&absent).is_some();
        InScans { effect, scans, views, is_placed }
    }

    /// The stage and the shot that the effect takes for a shot.
    fn seen<'s>(&self, stage: &'s Stage<'s>, shot: &Shot) -> (&'s Stage<'s>, Shot)
    where
        'a: 's,
    {
        if self.is_placed && shot.scan != 0 {
            (&self.views.stages[0], self.views.in_first(shot))
        } else {
            (stage, *shot)
        }
    }
}

impl Effect for InScans<'_> {
    fn about(&self) -> &About {
        self.effect.about()
    }

    fn summary(&self, values: &[f64]) -> Option<String> {
        self.effect.summary(values)
    }

    fn members(&self) -> &'static [&'static [usize]] {
        self.effect.members()
    }

    /// Those of the effect on the shots of its scans, as the stage of the first of these has them.
    fn starts(&self, _: &Stage, shots: &[Shot]) -> Vec<Vec<f64>> {
        let Some(&first) = self.scans.first() else {
            let shots = self.views.all_in_first(shots);
            return self.effect.starts(&self.views.stages[0], &shots);
        };
        let own: Vec<Shot> =
            shots.iter().filter(|shot| self.scans.contains(&shot.scan)).copied().collect();
        self.effect.starts(&self.views.stages[usize::from(first)], &own)
    }

    fn scans(&self) -> &[u16] {
        &self.scans
    }

    fn depends_on_time(&self) -> bool {
        self.effect.depends_on_time()
    }

    fn moves(&self) -> bool {
        self.effect.moves()
    }

    fn widest_difference(&self) -> f64 {
        self.effect.widest_difference()
    }

    fn twists(&self, values: &[f64], stage: &Stage, shot: &Shot) -> Vec<Twist> {
        let mut twists = self.effect.twists(values, stage, shot);
        if !self.acts_on(shot.scan) {
            twists.fill(Twist::default());
        }
        twists
    }

    fn form_error(&self, parameter: usize, values: &[f64]) -> f64 {
        self.effect.form_error(parameter, values)
    }

    fn vectors(&self) -> &'static [(&'static str, [usize; 3])] {
        self.effect.vectors()
    }

    fn motion(&self, values: &[f64], stage: &Stage, shot: &Shot) -> Option<Pose<Global, Global>> {
        self.effect.motion(values, stage, shot)
    }

    fn place(&self, values: &[f64]) -> Option<Place> {
        self.effect.place(values)
    }

    fn reach_off_axis_m(&self, values: &[f64]) -> f64 {
        self.effect.reach_off_axis_m(values)
    }

    fn scatter(
        &self,
        values: &[f64],
        stage: &Stage,
        law: &Brdf,
        shot: &Shot,
        f_per_sr: f64,
    ) -> f64 {
        self.effect.scatter(values, stage, law, shot, f_per_sr)
    }

    fn gain(&self, values: &[f64], stage: &Stage, shot: &Shot) -> f64 {
        let (stage, shot) = self.seen(stage, shot);
        self.effect.gain(values, stage, &shot)
    }

    fn multiply_gains(
        &self,
        values: &[f64],
        stage: &Stage,
        shots: &[Option<&Shot>],
        gains: &mut [f64],
    ) {
        let is_elsewhere = shots.iter().flatten().any(|shot| shot.scan != 0);
        if !(self.is_placed && is_elsewhere) {
            return self.effect.multiply_gains(values, stage, shots, gains);
        }
        // The shots of one task are of one scan.
        let seen: Vec<Option<Shot>> =
            shots.iter().map(|shot| shot.map(|shot| self.views.in_first(shot))).collect();
        let seen: Vec<Option<&Shot>> = seen.iter().map(Option::as_ref).collect();
        self.effect.multiply_gains(values, &self.views.stages[0], &seen, gains);
    }

    fn survey_key(&self, values: &[f64]) -> Option<Vec<f64>> {
        self.effect.survey_key(values)
    }

    fn survey(&self, values: &[f64], stage: &Stage, shots: &[Shot]) -> Survey {
        self.effect.survey(values, stage, shots)
    }

    fn shade(&self, survey: &Survey, laws: &[Brdf]) -> Survey {
        self.effect.shade(survey, laws)
    }

    fn arrive(&self, values: &[f64], shaded: &Survey, echoes: &mut [Option<MeanEcho>]) {
        self.effect.arrive(values, shaded, echoes);
    }

    fn receive(&self, values: &[f64], receiver: Receiver) -> Receiver {
        self.effect.receive(values, receiver)
    }
}
