//! The members of an effect's family: the effect with some of its parameters, the others absent.

use std::sync::LazyLock;

use super::echo::MeanEcho;
use super::effect::{About, Effect, EffectParameter, Survey};
use super::library::library;
use super::place::Place;
use super::receiver::Receiver;
use super::shot::{Shot, Stage};
use super::twist::Twist;
use crate::brdf::Brdf;
use crate::frames::{Global, Pose};

/// An effect with some of its parameters.
struct Member {
    whole: &'static dyn Effect,
    about: About,
    /// Places of its parameters among those of the whole effect.
    used: &'static [usize],
}

/// The members of every effect of the library, in the order of the library.
static MEMBERS: LazyLock<Vec<Member>> = LazyLock::new(|| {
    let mut members = Vec::new();
    for whole in library() {
        for used in whole.members() {
            let parameters: Vec<EffectParameter> =
                used.iter().map(|&place| searched(whole, place)).collect();
            // Made once for the whole program.
            let about = About { parameters: parameters.leak(), ..*whole.about() };
            members.push(Member { whole, about, used });
        }
    }
    members
});

/// The members of an effect's family, the simplest first; the effect alone where it has one form.
pub(crate) fn family(effect: &dyn Effect) -> Vec<&dyn Effect> {
    let members = MEMBERS.iter().filter(|member| member.about.name == effect.name());
    let members: Vec<&dyn Effect> = members.map(|member| member as &dyn Effect).collect();
    if members.is_empty() { vec![effect] } else { members }
}

/// A parameter with the range in which a search varies it.
fn searched(whole: &dyn Effect, place: usize) -> EffectParameter {
    let [min, max] = whole.searched(place);
    EffectParameter { min, max, ..whole.parameters()[place] }
}

impl Member {
    /// The values of all parameters.
    fn whole_values(&self, values: &[f64]) -> Vec<f64> {
        let mut all: Vec<f64> = self.whole.parameters().iter().map(|known| known.absent).collect();
        self.used.iter().zip(values).for_each(|(&place, value)| all[place] = *value);
        all
    }
}

/// Calls a method of the whole effect with all values.
macro_rules! whole {
    ($self:ident.$method:ident($values:ident $(, $argument:expr)*)) => {
        $self.whole.$method(&$self.whole_values($values) $(, $argument)*)
    };
}

impl Effect for Member {
    fn about(&self) -> &About {
        &self.about
    }

    fn summary(&self, values: &[f64]) -> Option<String> {
        whole!(self.summary(values))
    }

    /// Those of the whole effect in which only its own parameters are not absent, and these within their ranges.
    fn starts(&self, stage: &Stage, shots: &[Shot]) -> Vec<Vec<f64>> {
        let parameters = self.whole.parameters();
        let is_own = |start: &Vec<f64>| {
            let mut others = (0..parameters.len()).filter(|place| !self.used.contains(place));
            let mut own = self.used.iter().zip(self.about.parameters);
            others.all(|place| start[place] == parameters[place].absent)
                && own.all(|(&place, known)| (known.min..=known.max).contains(&start[place]))
        };
        let starts = self.whole.starts(stage, shots).into_iter().filter(is_own);
        starts.map(|start| self.used.iter().map(|&place| start[place]).collect()).collect()
    }

    fn depends_on_time(&self) -> bool {
        self.whole.depends_on_time()
    }

    fn moves(&self) -> bool {
        self.whole.moves()
    }

    fn widest_difference(&self) -> f64 {
        self.whole.widest_difference()
    }

    fn whole(&self, values: &[f64]) -> Option<(&'static dyn Effect, Vec<f64>)> {
        Some((self.whole, self.whole_values(values)))
    }

    fn twists(&self, values: &[f64], stage: &Stage, shot: &Shot) -> Vec<Twist> {
        let all = whole!(self.twists(values, stage, shot));
        self.used.iter().filter_map(|&place| all.get(place).copied()).collect()
    }

    fn motion(&self, values: &[f64], stage: &Stage, shot: &Shot) -> Option<Pose<Global, Global>> {
        whole!(self.motion(values, stage, shot))
    }

    fn place(&self, values: &[f64]) -> Option<Place> {
        whole!(self.place(values))
    }

    fn reach_off_axis_m(&self, values: &[f64]) -> f64 {
        whole!(self.reach_off_axis_m(values))
    }

    fn scatter(&self, values: &[f64], stage: &Stage, law: &Brdf, shot: &Shot, f: f64) -> f64 {
        whole!(self.scatter(values, stage, law, shot, f))
    }

    fn gain(&self, values: &[f64], stage: &Stage, shot: &Shot) -> f64 {
        whole!(self.gain(values, stage, shot))
    }

    fn multiply_gains(
        &self,
        values: &[f64],
        stage: &Stage,
        shots: &[Option<&Shot>],
        gains: &mut [f64],
    ) {
        whole!(self.multiply_gains(values, stage, shots, gains));
    }

    fn survey_key(&self, values: &[f64]) -> Option<Vec<f64>> {
        whole!(self.survey_key(values))
    }

    fn survey(&self, values: &[f64], stage: &Stage, shots: &[Shot]) -> Survey {
        whole!(self.survey(values, stage, shots))
    }

    fn shade(&self, survey: &Survey, laws: &[Brdf]) -> Survey {
        self.whole.shade(survey, laws)
    }

    fn arrive(&self, values: &[f64], shaded: &Survey, echoes: &mut [Option<MeanEcho>]) {
        whole!(self.arrive(values, shaded, echoes));
    }

    fn form_error(&self, parameter: usize, values: &[f64]) -> f64 {
        self.whole.form_error(self.used[parameter], &self.whole_values(values))
    }

    fn receive(&self, values: &[f64], receiver: Receiver) -> Receiver {
        whole!(self.receive(values, receiver))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::find;
    use crate::effects::testing::Bench;

    #[test]
    fn members_are_the_whole_effect_with_absent_parameters() {
        let bench = Bench::plate();
        assert!(MEMBERS.len() >= 3);
        for member in &*MEMBERS {
            let starts = member.starts(&bench.stage(), &bench.shots);
            assert!(!starts.is_empty(), "{}", member.name());
            for start in starts {
                let all = member.whole_values(&start);
                for shot in &bench.shots {
                    let own = member.gain(&start, &bench.stage(), shot);
                    assert_eq!(own, member.whole.gain(&all, &bench.stage(), shot));
                }
            }
        }
    }

    #[test]
    fn the_simplest_comes_first() {
        for effect in library() {
            let counts = family(effect).into_iter().map(|one| one.parameters().len());
            assert!(counts.is_sorted(), "{}", effect.name());
        }
        assert_eq!(family(find("speckle").unwrap()).len(), 1);
        assert_eq!(family(find("fov-gain").unwrap())[0].parameters().len(), 1);
    }
}
