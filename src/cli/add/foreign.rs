//! Files in other people's formats, and the flags that say what such a file does not.

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;

use crate::adopt::{check_frequency_and_threshold, foreign_format};
use crate::catalogue::exchange::Details;
use crate::cli::curves::kind_of;
use crate::cli::list::KINDS;
use crate::error::Error;
use crate::fit::{model, model_names};
use crate::formats::ColumnNames;
use crate::material::{Slug, SourceKind};
use crate::units::watts_from_dbm;

/// What a foreign file does not say.
#[derive(Debug, Default, PartialEq, clap::Args)]
#[command(next_help_heading = "For a .csv, .bsdf, .brdf or .yml file")]
pub(super) struct DetailArgs {
    /// Short name that the material gets
    #[arg(long, value_name = "NAME")]
    name: Option<Slug>,
    /// Our names for the columns of a .csv, as in inc=theta_deg,NRCS=sigma0_db; - passes one over
    #[arg(long, value_name = "THEIRS=OURS")]
    columns: Option<ColumnNames>,
    /// Full name [default: the short one]
    #[arg(long)]
    title: Option<String>,
    /// Class of material: metal, polymer, paint, tissue, textile, glass …
    #[arg(long)]
    class: Option<String>,
    /// What it is; `Not known: …` says what is not
    #[arg(long, value_name = "TEXT")]
    description: Option<String>,
    /// A word to find it by; may be repeated
    #[arg(long = "tag", value_name = "WORD")]
    tags: Vec<String>,
    /// Name of the curve [default: that of the file]
    #[arg(long, value_name = "NAME")]
    curve: Option<String>,
    /// SPDX identifier of the licence of the data
    #[arg(long, value_name = "SPDX")]
    licence: Option<String>,
    /// Citation or, for your own numbers, how they were made
    #[arg(long, value_name = "TEXT")]
    source: Option<String>,
    /// Who measured or wrote that, as in 'Doe, Jane'; may be repeated
    #[arg(long = "author", value_name = "NAME")]
    authors: Vec<String>,
    /// Year of it
    #[arg(long, value_name = "YYYY", allow_negative_numbers = true)]
    year: Option<u16>,
    /// Origin of the numbers
    #[arg(long, value_parser = kind_of(KINDS))]
    kind: Option<SourceKind>,
    /// Model that is fitted to a curve and rendered in its place; a table without backscatter needs one
    #[arg(long, value_name = "MODEL", value_parser = PossibleValuesParser::new(model_names()))]
    model: Option<String>,
    /// Name of the instrument
    #[arg(long, value_name = "TEXT")]
    instrument: Option<String>,
    /// Frequency of a curve, or of optical constants [default of these: 300]
    #[arg(long, value_name = "GHZ", allow_negative_numbers = true)]
    frequency: Option<f64>,
    /// Least power that counts as a detection
    #[arg(long, value_name = "DBM", allow_negative_numbers = true)]
    threshold: Option<f64>,
}

impl DetailArgs {
    /// Refuses flags that would be dropped in silence, and one name for several files.
    pub fn check(&self, from: &[PathBuf]) -> Result<(), Error> {
        let foreign =
            from.iter().filter(|path| !path.is_dir() && foreign_format(path).is_some()).count();
        let problem = match foreign {
            0 if *self != DetailArgs::default() => {
                "--name and its like say what a foreign file does not"
            }
            2.. => "several foreign files would get one name",
            _ => return Ok(()),
        };
        Err(Error::usage(
            problem,
            "name one .csv, .bsdf, .brdf or .yml file with --from, and no other",
        ))
    }

    /// The flags as plain values.
    pub fn given(&self) -> Result<Details, Error> {
        let frequency_hz = self.frequency.map(|ghz| ghz * 1e9);
        let threshold_w = self.threshold.map(watts_from_dbm);
        check_frequency_and_threshold(frequency_hz, threshold_w)?;
        Ok(Details {
            slug: self.name.clone(),
            columns: self.columns.clone().unwrap_or_default(),
            name: self.title.clone(),
            class: self.class.clone(),
            description: self.description.clone(),
            tags: self.tags.clone(),
            curve: self.curve.clone(),
            authors: self.authors.clone(),
            year: self.year,
            licence: self.licence.clone(),
            source: self.source.clone(),
            kind: self.kind,
            model: self.model.clone().and_then(|name| Some((name.clone(), model(&name)?))),
            instrument: self.instrument.clone(),
            frequency_hz,
            threshold_w,
        })
    }
}
