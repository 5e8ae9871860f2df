//! Everything that can go wrong, in one type, for the program and for callers that want one.

use std::path::PathBuf;

use thiserror::Error;

use crate::catalogue::exchange::{Detail, ExchangeError};
use crate::catalogue::{AboutError, CatalogueError};
use crate::diagnose::DiagnoseError;
use crate::diagnose::curve::CurveDiagnoseError;
use crate::effects::EffectError;
use crate::files::FilesError;
use crate::fit::FitError;
use crate::formats::FormatError;
use crate::formats::exr::ExrError;
use crate::formats::figure::FigureError;
use crate::formats::html::PageError;
use crate::material::MaterialError;
use crate::material::file::FileError;
use crate::measure::curve::ObservationError;
use crate::measure::{CalibrationError, CloudError, ReductionError, RegistrationError};
use crate::radar::{F5Error, RadarError};
use crate::render::RenderError;
use crate::scene::SceneError;
use crate::store::StoreError;

/// Any error of the library or the program.
#[derive(Debug, Error)]
pub enum Error {
    /// A scene cannot be loaded.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A scene cannot be loaded with changes that were asked for, and can without.
    #[error("{changes}: {error}")]
    Change {
        /// The change at fault, or all of them.
        changes: String,
        /// What is wrong.
        error: Box<Error>,
    },
    /// A radar cannot exist.
    #[error(transparent)]
    Radar(#[from] RadarError),
    /// Equation (1) cannot be had.
    #[error(transparent)]
    F5(#[from] F5Error),
    /// A scene cannot be rendered.
    #[error("{}: {antenna}{error}", scene.display())]
    Render {
        /// The scene file.
        scene: PathBuf,
        /// The receiver that it is about, with a colon, or nothing.
        antenna: String,
        /// What is wrong.
        error: Box<RenderError>,
    },
    /// An entry means no effect.
    #[error("{place}: {error}")]
    Effect {
        /// The file, and where in it.
        place: String,
        /// What is wrong.
        error: EffectError,
    },
    /// A material file was refused.
    #[error(transparent)]
    MaterialFile(#[from] FileError),
    /// A material says something impossible.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// The database refused.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A catalogue could not be published or taken over.
    #[error(transparent)]
    Catalogue(#[from] CatalogueError),
    /// A material could not be written in somebody else's format, or read from it.
    #[error(transparent)]
    Exchange(#[from] ExchangeError),
    /// What a catalogue shall say of itself was refused.
    #[error(transparent)]
    About(#[from] AboutError),
    /// A figure could not be drawn.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// A page could not be made.
    #[error(transparent)]
    Page(#[from] PageError),
    /// An image could not be encoded.
    #[error(transparent)]
    Exr(#[from] ExrError),
    /// A table could not be encoded.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A measured cloud was refused.
    #[error("{}: {error}", file.display())]
    Cloud {
        /// The cloud's file.
        file: PathBuf,
        /// What is wrong.
        error: CloudError,
    },
    /// There is no pose.
    #[error(transparent)]
    Registration(#[from] RegistrationError),
    /// A cloud does not calibrate a radar.
    #[error("{}: {error}", file.display())]
    Calibration {
        /// The cloud's file.
        file: PathBuf,
        /// What is wrong.
        error: CalibrationError,
    },
    /// There is no curve.
    #[error(transparent)]
    Reduction(#[from] ReductionError),
    /// A curve's file was refused.
    #[error("{}: {error}", file.display())]
    CurveFile {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        error: FormatError,
    },
    /// A material's curve is no backscatter curve.
    #[error("{curve}: {error}")]
    Observation {
        /// The material and its curve.
        curve: String,
        /// What is wrong.
        error: ObservationError,
    },
    /// A curve cannot be fitted.
    #[error("{curve}: {error}")]
    Fit {
        /// The file, or the material and its curve.
        curve: String,
        /// What is wrong.
        error: FitError,
    },
    /// A search that found no optimum; nothing was stored.
    #[error(
        "{curve}: the fit did not converge ({stop}), so nothing was stored; hold a parameter, try more starts or another \
         model"
    )]
    NotConverged {
        /// The file, or the material and its curve.
        curve: String,
        /// Why the search ended.
        stop: &'static str,
    },
    /// An answer that could not be stored or drawn, and its numbers that could be written.
    #[error("{error}; nothing was stored, and the answer is in {}", report.display())]
    Unstored {
        /// What is wrong.
        error: Box<Error>,
        /// The file with the answer.
        report: PathBuf,
    },
    /// Nothing can be said about a cloud.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
    /// Nothing can be said about a curve.
    #[error("{curve}: {error}")]
    CurveDiagnosis {
        /// The file.
        curve: String,
        /// Why.
        error: CurveDiagnoseError,
    },
    /// No such material.
    #[error("{asked_by}there is no material `{name}`; {way_out}")]
    UnknownMaterial {
        /// Who asked, with a colon, or nothing.
        asked_by: String,
        /// The name.
        name: String,
        /// The nearest name or how to add it.
        way_out: String,
    },
    /// A material without a curve.
    #[error("`{material}` has no curve; name another material, or give the file of a curve")]
    NoCurve {
        /// The material.
        material: String,
    },
    /// A database that was named and is not there.
    #[error("there is no database {}; check its path, `matdb add NAME` makes one", path.display())]
    NoDatabase {
        /// Its file.
        path: PathBuf,
    },
    /// Something that is to be stored lacks details.
    #[error("{what} needs more; state its {}", Detail::list(missing))]
    Missing {
        /// What is to be stored, with its article.
        what: &'static str,
        /// What is missing.
        missing: Vec<Detail>,
    },
    /// A detail of what is to be stored cannot be.
    #[error("the {} {problem}; {way_out}", detail.noun())]
    Detail {
        /// The detail.
        detail: Detail,
        /// What is wrong, as a predicate.
        problem: &'static str,
        /// What to do.
        way_out: &'static str,
    },
    /// A record could not be written as JSON.
    #[error("cannot write the record as JSON: {0}; please report this")]
    Json(#[from] serde_json::Error),
    /// A file or folder cannot be read or written.
    #[error(transparent)]
    Files(#[from] FilesError),
    /// Something that was asked for and cannot be.
    #[error("{problem}; {way_out}")]
    Usage {
        /// What is wrong.
        problem: String,
        /// What to do.
        way_out: String,
    },
}

impl Error {
    /// Something that was asked for and cannot be, and what to do.
    pub(crate) fn usage(problem: impl Into<String>, way_out: impl Into<String>) -> Error {
        Error::Usage { problem: problem.into(), way_out: way_out.into() }
    }
}
