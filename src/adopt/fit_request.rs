//! A fit as a user asks for it, checked before it runs.

use super::admission;
use super::fit_storage::{FitStorage, NewFit, StoredFit};
use super::fit_subject::FitSubject;
use crate::brdf::Brdf;
use crate::error::Error;
use crate::fit::coordinates::frequencies;
use crate::fit::{Fit, FitResult, Method, OwnLaw, model, model_names};
use crate::formats::ColumnNames;
use crate::formats::text::nearest;
use crate::radar::speckle::standard_deviation_db;
use crate::setup::{Database, find_material};
use crate::store::Store;

/// What to fit, how, and where the fit goes.
#[derive(Clone, Debug)]
pub struct FitRequest<'a> {
    /// A curve's CSV file, or `NAME` or `NAME@REVISION` of a material with a curve.
    pub what: &'a str,
    /// Curve of the material, by default the longest; or the name to store a file's curve under, by default the
    /// file's.
    pub curve: Option<&'a str>,
    /// Our names for the columns of a file.
    pub columns: ColumnNames,
    /// A model or a material, where the search starts; by default what the material renders, else `mixture`.
    pub model: Option<&'a str>,
    /// A law of a program's own, in the place of a model; such a fit cannot be stored.
    pub own: Option<(&'a str, &'a OwnLaw)>,
    /// How to fit.
    pub method: FitMethod,
    /// The exponent of the diffuse tail, held.
    pub alpha: Option<f64>,
    /// Other held parameters, by path.
    pub fixed: Vec<(String, f64)>,
    /// Looks of the speckle; `None` to estimate them.
    pub looks: Option<f64>,
    /// Thermal noise in each chirp, W; `None` for none.
    pub noise_w: Option<f64>,
    /// Deviation of the angle for orthogonal distance, rad; by default that of the curve.
    pub theta_sd_rad: Option<f64>,
    /// Deviation of the level for orthogonal distance, dB; by default that of speckle of one look.
    pub level_sd_db: Option<f64>,
    /// Angle between the specular and the diffuse piece of least squares, rad.
    pub split_rad: f64,
    /// Points that the search starts from.
    pub starts: usize,
    /// Seed of the starts and of the residuals of missing chirps.
    pub seed: u64,
    /// Name of the fit; by default that of the model and of the method.
    pub fit_name: Option<&'a str>,
    /// How the fit is to be stored, where it is.
    pub storage: Option<FitStorage>,
}

/// How a curve is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitMethod {
    /// Least squares in two pieces.
    Mse,
    /// Orthogonal distance in dB.
    Tls,
    /// Orthogonal distance with the tail's exponent given.
    TlsTail,
    /// Speckle and missing chirps by their laws.
    Censored,
}

/// Where the search of a fit starts.
#[derive(Clone, Debug)]
pub enum FitStart {
    /// A model with its values.
    Model(Brdf),
    /// A law of a program's own, by its name.
    Own(String, OwnLaw),
}

/// A request whose curve is loaded and that nothing hinders.
#[derive(Debug)]
pub struct CheckedFit {
    /// What is fitted.
    pub subject: FitSubject,
    /// Where the search starts.
    pub start: FitStart,
    /// Settings of the fit.
    pub fit: Fit,
    /// Name of the fit.
    pub fit_name: String,
    /// What a person should not overlook.
    pub notices: Vec<String>,
    storage: Option<FitStorage>,
}

/// A fit, and what became of it.
#[derive(Debug)]
pub struct FitOutcome {
    /// What was fitted.
    pub subject: FitSubject,
    /// The result.
    pub result: FitResult,
    /// The same as a material keeps it.
    pub fit: NewFit,
    /// Where it was stored, if it was.
    pub stored: Option<StoredFit>,
    /// Why the result is not what was asked for: it did not converge, or it could not be stored.
    pub refusal: Option<Error>,
}

impl FitMethod {
    /// The word of the command line and of the names of fits.
    pub fn as_str(self) -> &'static str {
        match self {
            FitMethod::Mse => "mse",
            FitMethod::Tls => "tls",
            FitMethod::TlsTail => "tls-tail",
            FitMethod::Censored => "censored",
        }
    }
}

impl<'a> FitRequest<'a> {
    /// The usual fit of a curve, by the censored likelihood; it is not stored.
    pub fn new(what: &'a str) -> FitRequest<'a> {
        let Fit { starts, seed, .. } = Fit::default();
        FitRequest {
            what,
            curve: None,
            columns: ColumnNames::default(),
            model: None,
            own: None,
            method: FitMethod::Censored,
            alpha: None,
            fixed: Vec::new(),
            looks: None,
            noise_w: None,
            theta_sd_rad: None,
            level_sd_db: None,
            split_rad: 6f64.to_radians(),
            starts,
            seed,
            fit_name: None,
            storage: None,
        }
    }

    /// Loads the curve and checks everything that could hinder the fit or its storing, since a fit takes a while.
    ///
    /// # Errors
    /// A curve, a material or a model that is not known; settings that do not suit them; what cannot be stored.
    pub fn check(self, store: Option<&Store>) -> Result<CheckedFit, Error> {
        let subject = FitSubject::open(self.what, self.curve, &self.columns, store)?;
        self.check_subject(subject, store)
    }

    /// As [`FitRequest::check`], of a curve that is loaded.
    ///
    /// # Errors
    /// As [`FitRequest::check`].
    pub fn check_subject(
        self,
        subject: FitSubject,
        store: Option<&Store>,
    ) -> Result<CheckedFit, Error> {
        let start = self.start(&subject, store)?;
        let fit = self.settings(&subject, &start)?;
        let fit_name = self.name(&start);
        let mut notices = subject.notices.clone();
        if let Some(storage) = &self.storage {
            let material = storage.check(&subject, &fit_name, store);
            let material = material.map_err(|error| how_to_add(error, &subject))?;
            if subject.file.is_some() {
                notices.extend(admission::doubts(&material));
            }
        }
        Ok(CheckedFit { subject, start, fit, fit_name, notices, storage: self.storage })
    }

    /// Where the search begins.
    fn start(&self, subject: &FitSubject, store: Option<&Store>) -> Result<FitStart, Error> {
        match self.own {
            Some((name, law)) => Ok(FitStart::Own(name.to_owned(), law.clone())),
            None => self.model_at_start(subject, store).map(FitStart::Model),
        }
    }

    fn model_at_start(&self, subject: &FitSubject, store: Option<&Store>) -> Result<Brdf, Error> {
        let Some(name) = self.model else {
            let default = subject.rendered_model().or_else(|| model("mixture"));
            return default.ok_or_else(|| no_model("mixture"));
        };
        if let Some(model) = model(name) {
            return Ok(model);
        }
        match find_material(store, name, "--model: ") {
            Ok(found) => Ok(found.material.scattering()?),
            Err(Error::UnknownMaterial { .. }) => Err(no_model(name)),
            Err(error) => Err(error),
        }
    }

    fn settings(&self, subject: &FitSubject, start: &FitStart) -> Result<Fit, Error> {
        let (lacking, rows) = (subject.curve.without_power(), subject.curve.observations.len());
        if self.noise_w.is_some() && lacking > 0 {
            return Err(Error::usage(
                format!(
                    "{lacking} of {rows} rows of {} have no power that noise could be compared with",
                    subject.label
                ),
                "leave --noise-dbm out, or fill in power_dbm, in a row without a detection that of the threshold",
            ));
        }
        let method = match self.method {
            FitMethod::Censored => Method::Censored,
            FitMethod::Mse => Method::Mse { split_rad: self.split_rad },
            FitMethod::Tls | FitMethod::TlsTail => Method::Tls {
                theta_sd_rad: self.theta_sd_rad.unwrap_or_else(|| subject.theta_sd_rad()),
                level_sd_db: self.level_sd_db.unwrap_or_else(|| standard_deviation_db(1.0)),
            },
        };
        let FitRequest { looks, noise_w, starts, seed, .. } = *self;
        let fixed = self.held(start)?;
        let beam_rad = subject.curve.illumination.beam_rad;
        Ok(Fit { method, fixed, bounds: Vec::new(), looks, beam_rad, noise_w, starts, seed })
    }

    /// The held parameters, each checked to be one of the model's: those that are named, and the model's frequencies.
    fn held(&self, start: &FitStart) -> Result<Vec<(String, f64)>, Error> {
        let paths = start.paths();
        let mut held = Vec::from_iter(self.held_alpha(&paths)?);
        for (path, value) in &self.fixed {
            if !paths.contains(path) {
                let way_out = format!("there are: {}", paths.join(", "));
                return Err(Error::usage(format!("the model has no parameter `{path}`"), way_out));
            }
            if is_held(path, &held) {
                return Err(Error::usage(format!("`{path}` is held twice"), "hold it once"));
            }
            held.push((path.clone(), *value));
        }
        let mut own = start.frequencies();
        own.retain(|(path, _)| !is_held(path, &held));
        held.extend(own);
        Ok(held)
    }

    /// The exponent of the model's tail, where it is given.
    fn held_alpha(&self, paths: &[String]) -> Result<Option<(String, f64)>, Error> {
        let path = paths.iter().find(|path| *path == "diffuse.alpha" || *path == "alpha");
        match (self.alpha, path) {
            (Some(value), Some(path)) => Ok(Some((path.clone(), value))),
            (Some(_), None) => Err(Error::usage("this model has no alpha", "leave --alpha out")),
            (None, Some(path))
                if self.method == FitMethod::TlsTail && is_held(path, &self.fixed) =>
            {
                Ok(None)
            }
            (None, _) if self.method == FitMethod::TlsTail => Err(Error::usage(
                "tls-tail takes the tail's exponent as given",
                "hold it, or use the method tls to find it (--alpha, --method)",
            )),
            (None, _) => Ok(None),
        }
    }

    fn name(&self, start: &FitStart) -> String {
        if let Some(name) = self.fit_name {
            return name.to_owned();
        }
        let model = match start {
            FitStart::Own(name, _) => name.clone(),
            FitStart::Model(law) => self.model.map_or_else(|| model_word(law), str::to_owned),
        };
        format!("{model}-{}", self.method.as_str())
    }
}

impl FitStart {
    /// The numbers that can be held, by path.
    fn paths(&self) -> Vec<String> {
        match self {
            FitStart::Model(law) => law.parameters().into_iter().map(|known| known.path).collect(),
            FitStart::Own(_, law) => law.parameters().iter().map(|own| own.name.clone()).collect(),
        }
    }

    /// The frequencies in a model, which belong to the radar.
    fn frequencies(&self) -> Vec<(String, f64)> {
        match self {
            FitStart::Model(law) => frequencies(law),
            FitStart::Own(..) => Vec::new(),
        }
    }
}

impl CheckedFit {
    /// Fits the curve; where the search converges to values in their ranges, holds angles out to judge the fit and
    /// stores it as it was asked.
    ///
    /// # Errors
    /// A curve or settings with which nothing can be fitted. That a fit did not converge or could not be stored is
    /// the [refusal](FitOutcome::refusal) of its outcome.
    pub fn run(self, database: &Database) -> Result<FitOutcome, Error> {
        let CheckedFit { subject, start, fit, fit_name, storage, .. } = self;
        let found = match &start {
            FitStart::Model(law) => fit.run(law, &subject.curve),
            FitStart::Own(_, law) => fit.run_own(law, &subject.curve),
        };
        let mut result =
            found.map_err(|error| Error::Fit { curve: subject.label.clone(), error })?;
        let (mut stored, mut refusal) = (None, None);
        let is_possible = result.model.validate().is_ok();
        if !result.converged {
            let (curve, stop) = (subject.label.clone(), result.stop.as_str());
            refusal = Some(Error::NotConverged { curve, stop });
        } else if is_possible {
            result.held_out = result.hold_out(&subject.curve);
            let fit = NewFit::new(&result, &fit_name, &subject.curve_name);
            let saved = storage.map(|storage| storage.save(&subject, &fit, database));
            match saved.transpose() {
                Ok(saved) => stored = saved,
                Err(error) => refusal = Some(error),
            }
        } else if storage.is_some() {
            refusal = Some(out_of_range(&subject));
        }
        let fit = NewFit::new(&result, &fit_name, &subject.curve_name);
        Ok(FitOutcome { subject, result, fit, stored, refusal })
    }
}

/// The refusal to store a law that no material can have.
pub(super) fn out_of_range(subject: &FitSubject) -> Error {
    Error::usage(
        format!("{}: nothing is stored, since the fit is out of range", subject.label),
        "the verdict says what to let go of",
    )
}

fn is_held(path: &str, held: &[(String, f64)]) -> bool {
    held.iter().any(|(known, _)| known == path)
}

/// The word that files use for a model.
fn model_word(model: &Brdf) -> String {
    let value = serde_json::to_value(model).unwrap_or_default();
    value["model"].as_str().unwrap_or("model").to_owned()
}

fn no_model(name: &str) -> Error {
    let way_out = match nearest(name, model_names()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => {
            format!("name a material or one of {}", model_names().collect::<Vec<_>>().join(", "))
        }
    };
    Error::usage(format!("there is no model and no material `{name}`"), way_out)
}

/// The error with the commands that make the material of a file's curve, where it is that there is no such material.
fn how_to_add(error: Error, subject: &FitSubject) -> Error {
    match error {
        Error::UnknownMaterial { asked_by, name, way_out } if subject.file.is_some() => {
            let meant = way_out.starts_with("did you mean");
            let meant = if meant { format!("{way_out} Else ") } else { String::new() };
            let way_out = format!(
                "{meant}`matdb add --from {} --name {name} --class CLASS …` makes one of the curve, and then \
                 `matdb fit {name} --save` stores the fit",
                subject.wanted
            );
            Error::UnknownMaterial { asked_by, name, way_out }
        }
        error => error,
    }
}
