//! A measured curve into a material, with where it comes from.

use clap::ValueEnum;

use super::door;
use crate::adopt::{add_source, free_key};
use crate::error::Error;
use crate::material::form::is_licence;
use crate::material::{Curve, Instrument, Material, SourceKind};
use crate::measure;
use crate::units::watts_from_dbm;

/// How a curve came to be, as flags say it.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Kind {
    Measured,
    Synthetic,
}

impl From<Kind> for SourceKind {
    fn from(kind: Kind) -> SourceKind {
        match kind {
            Kind::Measured => SourceKind::Measured,
            Kind::Synthetic => SourceKind::Synthetic,
        }
    }
}

/// The way out for whoever has not said where a curve comes from.
pub(super) const UNSAID: &str = "add --kind measured or --kind synthetic, and --source with who, when and \
    how; a measured curve needs --licence, --instrument, --frequency and --threshold, too";

/// What a person says of a curve that is to be stored.
#[derive(Debug, Default, PartialEq, clap::Args)]
#[command(next_help_heading = "For a measured curve that is stored")]
pub(super) struct Circumstances {
    /// SPDX identifier of the licence of its data
    #[arg(long, value_name = "SPDX", requires = "save")]
    licence: Option<String>,
    /// Name of the instrument, one of the material's or a new one
    #[arg(long, value_name = "TEXT", requires = "save")]
    instrument: Option<String>,
    /// Centre frequency of a new instrument
    #[arg(long, value_name = "GHZ", requires = "save")]
    frequency: Option<f64>,
    /// Least power that counts as a detection with a new instrument
    #[arg(long, value_name = "DBM", requires = "save", allow_negative_numbers = true)]
    threshold: Option<f64>,
}

impl Circumstances {
    /// Refuses a measured curve of which not enough is said, before anything is computed for it.
    pub fn check(&self, material: &Material, kind: SourceKind) -> Result<(), Error> {
        let usage = |problem: &str, way_out: String| {
            Err(Error::Usage { problem: problem.to_owned(), way_out })
        };
        if self.licence.as_ref().is_some_and(|licence| !is_licence(licence)) {
            let way_out = "write an SPDX identifier such as CC-BY-4.0, or LicenseRef-proprietary";
            return usage("--licence is no SPDX expression", way_out.to_owned());
        }
        let is_possible = |number: f64| number > 0.0 && number.is_finite();
        if !self.frequency.is_none_or(is_possible)
            || !self.threshold.is_none_or(|dbm| is_possible(watts_from_dbm(dbm)))
        {
            let way_out = "give a frequency in GHz such as 300, a threshold in dBm such as -77";
            return usage("--frequency or --threshold cannot be", way_out.to_owned());
        }
        let known = self.known(material);
        let is_other = |known: &Instrument| {
            self.frequency.is_some_and(|ghz| ghz * 1e9 != known.centre_frequency_hz)
                || self.threshold.is_some_and(|dbm| known.threshold_w != Some(watts_from_dbm(dbm)))
        };
        if known.is_some_and(is_other) {
            let way_out = "leave --frequency and --threshold out, or name another --instrument";
            let problem =
                "the material's instrument of that name has another frequency or threshold";
            return usage(problem, way_out.to_owned());
        }
        let is_measured = kind == SourceKind::Measured;
        let is_said =
            self.instrument.is_some() || self.frequency.is_some() || self.threshold.is_some();
        let has = |is_there: bool, is_needed: bool| is_there || known.is_some() || !is_needed;
        let wanted = [
            (self.licence.is_some() || !is_measured, "--licence CC-BY-4.0"),
            (
                has(self.instrument.is_some(), is_measured || is_said),
                "--instrument \"name of the radar\"",
            ),
            (has(self.frequency.is_some(), is_measured || is_said), "--frequency 300"),
            (has(self.threshold.is_some(), is_measured), "--threshold -77"),
        ];
        let missing: Vec<&str> =
            wanted.into_iter().filter(|(is_there, _)| !is_there).map(|(_, flag)| flag).collect();
        match (missing.is_empty(), is_measured) {
            (true, _) => Ok(()),
            (_, true) => {
                usage("a measured curve needs more", format!("add {}", missing.join(", ")))
            }
            (_, false) => {
                usage("the instrument of a curve needs more", format!("add {}", missing.join(", ")))
            }
        }
    }

    /// The instrument of the material that is meant.
    fn known<'a>(&self, material: &'a Material) -> Option<&'a Instrument> {
        let name = self.instrument.as_ref()?;
        material.instruments.iter().find(|known| known.key == *name || known.name == *name)
    }

    /// The key of the instrument, which is added when it is a new one.
    fn instrument(&self, material: &mut Material) -> Option<String> {
        if let Some(known) = self.known(material) {
            return Some(known.key.clone());
        }
        let name = self.instrument.clone()?;
        let centre_frequency_hz = self.frequency? * 1e9;
        let key = free_key("radar", material.instruments.iter().map(|instrument| &instrument.key));
        material.instruments.push(Instrument {
            key: key.clone(),
            name,
            centre_frequency_hz,
            threshold_w: self.threshold.map(watts_from_dbm),
            ..Instrument::default()
        });
        Some(key)
    }
}

/// A curve of a material.
pub(super) struct Put {
    /// Its name.
    pub curve: String,
    /// Key of its source.
    pub source: String,
}

/// Puts a curve into a material, unless the very same is there, maybe under another name.
pub(super) fn put(
    material: &mut Material,
    name: &str,
    curve: &measure::Curve,
    (kind, title): (SourceKind, &str),
    circumstances: &Circumstances,
) -> Result<Put, Error> {
    circumstances.check(material, kind)?;
    let source = add_source(material, kind, title, name, circumstances.licence.as_deref());
    let slug = material.slug.clone();
    let is_same = |known: &&Curve| {
        measure::Curve::from_observations(&known.observations).is_ok_and(|known| known == *curve)
    };
    if let Some(Curve { name: known, source: its, .. }) = material.curves.iter().find(is_same) {
        return match *its == source {
            true => Ok(Put { curve: known.clone(), source }),
            false => Err(Error::Usage {
                problem: format!(
                    "`{slug}` has these points already, as the curve `{known}` from {}",
                    title_of(material, its)
                ),
                way_out: format!("`matdb fit {slug} --curve {known} --save` fits that"),
            }),
        };
    }
    let taken = material.curves.iter().find(|known| known.name == name);
    let what = match taken {
        Some(known) => {
            Some(format!("another curve `{name}`, from {}", title_of(material, &known.source)))
        }
        None => {
            let fit = material.fits.iter().find(|fit| fit.name == name);
            fit.map(|_| format!("a fit of the name `{name}`"))
        }
    };
    if let Some(what) = what {
        return Err(Error::Usage {
            problem: format!("`{slug}` has {what}"),
            way_out: "give this curve another name with --curve".to_owned(),
        });
    }
    let curve = Curve {
        name: name.to_owned(),
        source: source.clone(),
        instrument: circumstances.instrument(material),
        session: None,
        observations: curve.observations.clone(),
    };
    match door::missing(material, &curve).as_slice() {
        [] => material.curves.push(curve),
        missing => {
            let what: Vec<&str> = missing.iter().map(|gap| gap.what.as_str()).collect();
            return Err(Error::Usage {
                problem: format!("a measured curve needs more: {}", what.join("; ")),
                way_out: "name another --instrument, with --frequency and --threshold".to_owned(),
            });
        }
    }
    Ok(Put { curve: name.to_owned(), source })
}

/// What a source says of itself.
fn title_of<'a>(material: &'a Material, key: &str) -> &'a str {
    let source = material.sources.iter().find(|source| source.key == key);
    source.map_or("nowhere", |source| &source.title)
}
