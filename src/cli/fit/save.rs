//! A fit into a material, as a new revision.

use std::path::PathBuf;

use serde::Serialize;

use super::{Args, Subject};
use crate::adopt::{activity, add_source};
use crate::cli::curves::{self, Put};
use crate::cli::database::Database;
use crate::error::Error;
use crate::fit::{Finding, FitResult};
use crate::material::{Curve, FitReport, Material, SourceKind};
use crate::setup::{MaterialRevision, find_material};
use crate::store::Store;

/// Where a fit was stored.
#[derive(Serialize)]
pub(super) struct Saved {
    pub material: String,
    pub revision: u32,
    pub fit: String,
    pub curve: String,
    /// What scenes render of the material now.
    pub render: String,
    /// Whether the fit leaves the curve open somewhere, so that it is not rendered.
    pub curve_is_open: bool,
    pub database: String,
}

/// The material that takes the fit in, with its curve and the source of it.
pub(super) struct Target {
    pub material: Material,
    curve: String,
    source: String,
}

impl Target {
    /// `None` when nothing is to be stored.
    pub fn find(
        args: &Args,
        subject: &Subject,
        fit_name: &str,
        store: Option<&Store>,
    ) -> Result<Option<Target>, Error> {
        let Some(wanted) = &args.save else { return Ok(None) };
        let target = match &subject.found {
            Some(found) => of_material(args, subject, found, wanted.as_deref(), store)?,
            None => of_file(args, subject, wanted.as_deref(), store)?,
        };
        let stated = target.material.fits.iter().any(|f| f.name == fit_name && f.report.is_none());
        let curve = target.material.curves.iter().any(|c| c.name == fit_name);
        let what = if curve { "a curve" } else { "a fit that nobody fitted here" };
        if stated || curve {
            let slug = &target.material.slug;
            return Err(usage(
                format!("`{slug}` has {what} of the name `{fit_name}`"),
                "give the fit another name with --fit-name",
            ));
        }
        Ok(Some(target))
    }
}

fn of_material(
    args: &Args,
    subject: &Subject,
    found: &MaterialRevision,
    wanted: Option<&str>,
    store: Option<&Store>,
) -> Result<Target, Error> {
    let slug = &found.material.slug;
    if wanted.is_some_and(|name| name != slug.as_str()) {
        return Err(usage(
            format!("a fit of a curve of `{slug}` belongs to `{slug}`"),
            "leave the name after --save out",
        ));
    }
    let is_silent = args.circumstances == curves::Circumstances::default();
    if args.kind.is_some() || args.source.is_some() || !is_silent {
        return Err(usage(
            format!("the curve of `{slug}` has a source already"),
            "leave --kind, --source and what goes with them out",
        ));
    }
    // As it is now: it may have been revised while the fit ran.
    let material = find_material(store, slug.as_str(), "")?.material;
    let same = |curve: &&Curve| curve.name == subject.curve_name;
    let [fitted, current] =
        [&found.material, &material].map(|material| material.curves.iter().find(same).cloned());
    match current {
        Some(curve) if fitted.as_ref() == Some(&curve) => {
            Ok(Target { material, curve: curve.name, source: curve.source })
        }
        _ => Err(usage(
            format!("the curve of {} is not that of the current revision", args.what),
            "fit the current one, or leave --save out",
        )),
    }
}

fn of_file(
    args: &Args,
    subject: &Subject,
    wanted: Option<&str>,
    store: Option<&Store>,
) -> Result<Target, Error> {
    let Some(name) = wanted else {
        return Err(usage(
            format!("{} belongs to no material yet", subject.label),
            "name the one to store it in, as in --save my-paint",
        ));
    };
    if name.contains('@') {
        return Err(usage(
            format!("`{name}` names a revision, and a revision never changes"),
            "give the bare name; the fit becomes a new revision",
        ));
    }
    let (Some(kind), Some(title)) = (args.kind, &args.source) else {
        return Err(usage(
            format!("nobody has said where {} comes from", subject.label),
            curves::UNSAID,
        ));
    };
    let mut material = match find_material(store, name, "--save: ") {
        Err(Error::UnknownMaterial { asked_by, name, way_out }) => {
            let meant = match way_out.starts_with("did you mean") {
                true => format!("{way_out} Else "),
                false => String::new(),
            };
            let way_out = format!(
                "{meant}`matdb add --from {} --name {name} --class CLASS …` makes one of the curve, and then \
                 `matdb fit {name} --save` stores the fit",
                args.what
            );
            return Err(Error::UnknownMaterial { asked_by, name, way_out });
        }
        found => found?.material,
    };
    let (curve, name) = (&subject.curve, &subject.curve_name);
    let said = (kind.into(), title.as_str());
    let Put { curve, source } = curves::put(&mut material, name, curve, said, &args.circumstances)?;
    Ok(Target { material, curve, source })
}

/// The source of every parameter that somebody chose and no data gave, by path.
fn chosen(material: &mut Material, found: &FitResult) -> Vec<(String, String)> {
    const CHOSEN: &str = "Chosen, while the other parameters were fitted";
    const CONVENTION: &str = "Convention: k is chosen, and f_lambda and r_s follow from it; the curve tells \
                              S = (1 − k)·f_lambda and R = k·r_s";
    let held: Vec<String> = found.fit.fixed.iter().map(|(path, _)| path.clone()).collect();
    let is_free = |path: &&str| found.gauge_k.is_some() && held.iter().all(|known| known != path);
    let by_convention: Vec<String> =
        FitReport::BY_CONVENTION.into_iter().filter(is_free).map(str::to_owned).collect();
    let mut sources = Vec::new();
    for (paths, title, key) in [(held, CHOSEN, "chosen"), (by_convention, CONVENTION, "convention")]
    {
        if !paths.is_empty() {
            let key = add_source(material, SourceKind::Synthetic, title, key, None);
            sources.extend(paths.into_iter().map(|path| (path, key.clone())));
        }
    }
    sources.sort();
    sources.dedup_by(|a, b| a.0 == b.0);
    sources
}

/// Stores a fit; a fit of the same name gives way to it, and stays in the revisions before.
pub(super) fn save(
    args: &Args,
    subject: &Subject,
    name: &str,
    found: &FitResult,
    db: &Database,
) -> Result<Saved, Error> {
    let mut store = db.write()?;
    store.record(activity("fit", &subject.file.iter().map(PathBuf::as_path).collect::<Vec<_>>())?);
    let Some(target) = Target::find(args, subject, name, Some(&store))? else {
        return Err(usage("nothing is to be stored".to_owned(), "add --save"));
    };
    let Target { mut material, curve, source: key } = target;
    let mut fit = found.stored(name, &curve, &key);
    fit.parameter_sources = chosen(&mut material, found);
    match material.fits.iter_mut().find(|known| known.name == name) {
        Some(known) => *known = fit,
        None => material.fits.push(fit),
    }
    let is_open = found.verdict.iter().any(Finding::leaves_the_curve_open);
    if !args.keep_render && !is_open {
        material.render = name.to_owned();
    }
    let revision = store.add([&material])?.first().map_or(1, |added| added.revision());
    Ok(Saved {
        material: material.slug.to_string(),
        revision,
        fit: name.to_owned(),
        curve,
        render: material.render,
        curve_is_open: is_open,
        database: db.path().display().to_string(),
    })
}

fn usage(problem: String, way_out: &str) -> Error {
    Error::Usage { problem, way_out: way_out.to_owned() }
}
