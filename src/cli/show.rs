//! `matdb show`.

mod about;

use serde_json::json;

use super::console::Console;
use super::fit::words::report;
use super::summary::{counted, table};
use crate::error::Error;
use crate::formats::EffectEntry;
use crate::material::{Fit, Material};
use crate::radar::Radar;
use crate::report::{AT_A_GLANCE_DEG, LevelRow, Sigma0Level, drawn_words, level_rows};
use crate::setup::Database;
use crate::setup::{
    MaterialRevision, find_material, later_status_warning, unmet_conditions, unmet_sentence,
};
use crate::store::{RevisionSummary, StoreError};
use crate::units::{range, shown};

/// Show a material: what is known of it, from whom, and how it scatters
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb show mannequin-paint
  matdb show mannequin-paint@1 --json      an earlier revision, as JSON")]
pub(super) struct Args {
    /// NAME or NAME@REVISION
    name: String,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let store = db.read()?;
    let MaterialRevision { material, revision } = find_material(store.as_ref(), &args.name, "")?;
    let later = later_status_warning(store.as_ref(), &material.slug, revision)?;
    later.iter().for_each(|later| console.notice(later));
    let origin = match revision {
        Some(number) => format!("revision {number} in {}", db.path().display()),
        None => format!("built in; `matdb add {}` puts it into a database", material.slug),
    };
    let history = match store.map(|store| store.history(&material.slug)) {
        // This revision is sound.
        Some(Err(StoreError::Corrupt { problem, .. })) => {
            console.notice(&format!("its revisions are not listed: {problem}"));
            None
        }
        history => Some(history.transpose()?.unwrap_or_default()),
    };
    let mut text = describe(&material, &origin)?;
    let listed = history.as_deref().unwrap_or_default();
    if !listed.is_empty() {
        text += "\nrevisions:\n";
    }
    for RevisionSummary { revision, added_at, program_version, origin } in listed {
        let origin = origin.as_ref().map_or(String::new(), |title| format!(", from {title}"));
        text += &format!("{revision}  {added_at}  by matdb {program_version}{origin}\n");
    }
    console
        .result(&text, &json!({ "revision": revision, "material": material, "history": history }))
}

fn describe(material: &Material, origin: &str) -> Result<String, Error> {
    let mut text = format!("{} – {}\n{origin}\n\n", material.slug, material.name);
    if !material.description.is_empty() {
        text += &format!("{}\n\n", material.description);
    }
    text += &format!(
        "class {}, licence {}, {} GHz, {}°\n\n",
        material.class,
        material.licence,
        range(material.frequency_hz.map(|f| f / 1e9)),
        range(material.theta_rad.map(f64::to_degrees))
    );
    text += &status(material);
    text += &sources(material);
    text += &about::composition(material);
    text += &about::sessions(material);
    text += &about::instruments(material);
    for curve in &material.curves {
        let censored = curve.observations.iter().filter(|o| o.sigma0.is_none()).count();
        text += &format!(
            "\ncurve {}: {}, {censored} of them below the threshold{}, from {}{}\n    {}; {}\n",
            curve.name,
            counted(curve.observations.len(), "point"),
            if curve.illumination.relative { ", of relative levels" } else { "" },
            curve.source,
            curve.instrument.as_ref().map_or(String::new(), |key| format!(", by {key}")),
            curve.illumination.footprint_words(),
            curve.illumination.beam_words(),
        );
    }
    for fit in &material.fits {
        let lobes = fit.lobes_words().map_or(String::new(), |words| format!(", {words}"));
        text += &format!("\nfit {} ({}{lobes})\n{}", fit.name, fit.estimator, parameters(fit));
        if let Some([specular, diffuse]) = fit.identified_products() {
            text += &format!(
                "a monostatic measurement tells only (1 − k)·f_lambda = {specular:.3e} and \
                 k·r_s = {diffuse:.3e}; k, f_lambda and r_s by themselves are a convention\n"
            );
        }
        for condition in
            unmet_conditions(&fit.model, Radar::default().wavelength_m(), Some(material))
        {
            text += &format!("outside of its derivation: {}\n", unmet_sentence(&condition));
        }
        text += &fit.report.as_ref().map_or(String::new(), report);
    }
    text += &effects(material);
    text += &about::findings(material);
    text += &format!("\nscenes render `{}`:\n{}", material.render, curve_table(material)?);
    Ok(text)
}

/// Whether it may still be used, and what is not known of it.
fn status(material: &Material) -> String {
    let mut text = String::new();
    if let Some(sentence) = material.status.sentence() {
        text += &format!("{sentence}\n\n");
    }
    for sentence in &material.unknown {
        text += &format!("not known: {sentence}\n");
    }
    text + if material.unknown.is_empty() { "" } else { "\n" }
}

fn sources(material: &Material) -> String {
    let mut text = String::new();
    for source in &material.sources {
        text += &format!("source {} ({}): {}", source.key, source.kind.as_str(), source.titled());
        if let Some(doi) = &source.doi {
            text += &format!(", doi:{doi}");
        } else if let Some(url) = &source.url {
            text += &format!(", {url}");
        }
        text += "\n";
        if let Some(note) = &source.note {
            text += &format!("    {note}\n");
        }
    }
    text
}

/// As they are stored: a later program may know more of them than this one.
fn effects(material: &Material) -> String {
    let mut text = String::new();
    for EffectEntry { name, source, parameters } in &material.effects {
        let from = source.as_ref().map_or(String::new(), |source| format!(", from {source}"));
        text += &format!("\neffect {name}{from}\n");
        if let Some(effect) = crate::effects::find(name) {
            text += &format!("    {}\n", effect.description());
        }
        let rows = parameters.iter().map(|(parameter, value)| {
            [parameter.clone(), shown(*value), unit_of(name, parameter).unwrap_or_default()]
        });
        text += &table(&["parameter", "value", "unit"], rows);
    }
    text
}

/// The unit of a parameter of an effect, if this program knows both.
fn unit_of(effect: &str, parameter: &str) -> Option<String> {
    let known = crate::effects::find(effect)?.parameters();
    Some(known.iter().find(|known| known.name == parameter)?.unit.to_owned())
}

fn parameters(fit: &Fit) -> String {
    let covariance = fit.covariance.as_ref();
    table(
        &["parameter", "value", "unit", "± sd", "range", "source"],
        fit.model.parameters().iter().map(|p| {
            let sd = covariance.and_then(|known| known.standard_deviation(&p.path));
            [
                p.path.clone(),
                shown(p.value),
                p.unit.to_owned(),
                sd.map_or("none given".to_owned(), |sd| format!("{sd:.2e}")),
                format!("{} to {}", shown(p.min), shown(p.max)),
                source_of(fit, &p.path),
            ]
        }),
    )
}

/// Where the value of a parameter comes from.
fn source_of(fit: &Fit, path: &str) -> String {
    if fit.report.as_ref().is_some_and(|report| report.is_by_convention(path)) {
        return "a convention, not measured".to_owned();
    }
    let own = fit.parameter_sources.iter().find(|(known, _)| known == path);
    own.map_or(fit.source.clone(), |(_, source)| source.clone())
}

fn curve_table(material: &Material) -> Result<String, Error> {
    let rows = level_rows(material, &AT_A_GLANCE_DEG)?;
    let rows = rows.into_iter().map(|LevelRow { theta_deg, level, outside_deg }| {
        let level = match level {
            Sigma0Level::BelowDb(threshold_db) => format!("< {threshold_db:.1}"),
            Sigma0Level::Db(sigma0_db) => format!("{sigma0_db:.1}"),
            Sigma0Level::Nothing => "nothing".to_owned(),
        };
        let said = if outside_deg > 0.0 {
            format!("{}° outside the range", shown(outside_deg))
        } else {
            String::new()
        };
        [format!("{theta_deg:.0}°"), level, said]
    });
    let table = table(&["incidence", "sigma0 dB", ""], rows);
    Ok(drawn_words(material)?.map_or(table.clone(), |words| format!("{table}{words}\n")))
}
