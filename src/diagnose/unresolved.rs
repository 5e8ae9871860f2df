//! Surfaces within a range cell of each other, such as skin and the cloth on it: one echo, of the sum of their powers.

use std::collections::HashMap;

use crate::brdf::{Brdf, Scattering};
use crate::effects::{About, Effect, Level, MeanEcho, Shot, Stage, Survey};
use crate::frames::{Direction, Surface};

/// What else the echoes of shots hold, as a scene with sheets has it. It has no number to be found.
#[derive(Debug, Default)]
pub(super) struct Unresolved {
    others: HashMap<(u32, u8), Vec<Shot>>,
}

impl Unresolved {
    /// Adds surfaces that are a part of the echo of a shot.
    pub fn add(&mut self, shot: &Shot, others: &[Shot]) {
        if !others.is_empty() {
            self.others.insert((shot.chirp, shot.sheets), others.to_vec());
        }
    }

    /// Whether every echo is of one surface.
    pub fn is_empty(&self) -> bool {
        self.others.is_empty()
    }
}

const ABOUT: About = About {
    name: "unresolved-surfaces",
    level: Level::Scene,
    description: "Surfaces within a range cell of each other have one echo.",
    signature: "Echoes of two surfaces at once.",
    parameters: &[],
    conflicts: &[],
    has_one_form: true,
};

/// A surface in an echo, apart from its law.
struct Part {
    region: u16,
    to_radar: Direction<Surface>,
    /// How far the beam widens its lobes, and its divergence, rad.
    widening_rad: f64,
    beam_rad: f64,
    /// Power, W, where f is 1/sr.
    watts_per_f: f64,
    range_m: f64,
}

impl Part {
    fn new(stage: &Stage, shot: &Shot) -> Part {
        let (beam, hit) = (stage.beam(shot), shot.hit);
        let once_w = stage.link.power_w(&beam, hit.range_m, hit.cos_theta, 1.0);
        Part {
            region: shot.region,
            to_radar: shot.to_radar(),
            widening_rad: stage.widening_of_shot_rad(shot),
            beam_rad: stage.divergence_rad(shot),
            watts_per_f: shot.by_sheets * once_w,
            range_m: hit.range_m + shot.longer_m,
        }
    }

    /// Its echo by the laws of the regions.
    fn echo(&self, laws: &[Brdf]) -> MeanEcho {
        let Some(law) = laws.get(usize::from(self.region)) else {
            return MeanEcho::at_once(0.0, self.range_m);
        };
        let seen_by = |beam_rad| law.seen_by(beam_rad, self.to_radar, self.to_radar);
        let power_w = self.watts_per_f * seen_by(self.widening_rad).f_per_sr;
        let coherent_share = seen_by(self.beam_rad).coherent_share;
        MeanEcho { coherent_share, ..MeanEcho::at_once(power_w, self.range_m) }
    }
}

impl Effect for Unresolved {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        vec![Vec::new()]
    }

    fn survey_key(&self, _values: &[f64]) -> Option<Vec<f64>> {
        Some(Vec::new())
    }

    /// The surface of every shot, and after it the others in its echo.
    fn survey(&self, _values: &[f64], stage: &Stage, shots: &[Shot]) -> Survey {
        let parts = shots.iter().map(|shot| {
            let others = self.others.get(&(shot.chirp, shot.sheets)).into_iter().flatten();
            let all = [shot].into_iter().chain(others);
            all.map(|shot| Part::new(stage, shot)).collect()
        });
        Box::new(parts.collect::<Vec<Vec<Part>>>())
    }

    /// Power of every shot's surface by the laws alone, W, and the echo of the others; none where it is alone.
    fn shade(&self, survey: &Survey, laws: &[Brdf]) -> Survey {
        let all = survey.downcast_ref::<Vec<Vec<Part>>>().map_or(&[][..], Vec::as_slice);
        let shaded = all.iter().map(|parts| {
            let (own, others) = parts.split_first()?;
            let others = others.iter().map(|part| part.echo(laws)).reduce(MeanEcho::with)?;
            Some((own.echo(laws).power_w, others))
        });
        Box::new(shaded.collect::<Vec<Option<(f64, MeanEcho)>>>())
    }

    /// Effects that change the power of a shot change that of the whole echo.
    fn arrive(&self, _values: &[f64], shaded: &Survey, echoes: &mut [Option<MeanEcho>]) {
        type Shaded = Vec<Option<(f64, MeanEcho)>>;
        let all = shaded.downcast_ref::<Shaded>().map_or(&[][..], Vec::as_slice);
        for (echo, shaded) in echoes.iter_mut().zip(all) {
            if let (Some(echo), Some((own_w, others))) = (echo, shaded)
                && *own_w > 0.0
            {
                let power_w = others.power_w * echo.power_w / own_w;
                *echo = echo.with(MeanEcho { power_w, ..*others });
            }
        }
    }
}
