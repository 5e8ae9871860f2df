//! The Python module of matdb: bindings only, each function one call of the library. Inside are SI units; what Python
//! sees says its unit in its name.

#![warn(missing_docs)]

mod arrow;
mod begin;
mod cloud;
mod command;
mod compare;
mod curve;
mod database;
mod dataset;
mod diagnose;
mod effect;
mod error;
mod fit;
mod interrupt;
mod json;
mod material;
mod measure;
mod numbers;
mod own;
mod pose;
mod scan;
mod scene;
mod table;
mod words;

/// The extension module, which `matdb/__init__.py` shows to users.
#[pyo3::pymodule(gil_used = false)]
mod _matdb {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::begin::{Radar, new_material, new_scene, radar};
    #[pymodule_export]
    use crate::cloud::Cloud;
    #[pymodule_export]
    use crate::command::_run;
    #[pymodule_export]
    use crate::compare::{Comparison, calibrate, compare};
    #[pymodule_export]
    use crate::curve::diagnose_curve;
    #[pymodule_export]
    use crate::database::{Database, open, verify};
    #[pymodule_export]
    use crate::dataset::{Dataset, dataset};
    #[pymodule_export]
    use crate::diagnose::{Diagnosis, diagnose, effects};
    #[pymodule_export]
    use crate::effect::{Effect, Shots};
    #[pymodule_export]
    use crate::error::{
        CatalogueError, CloudError, DiagnoseError, Error, FileError, FitError, MaterialError,
        RenderError, SceneError, StoreError, UsageError,
    };
    #[pymodule_export]
    use crate::fit::{Fit, fit};
    #[pymodule_export]
    use crate::material::Material;
    #[pymodule_export]
    use crate::measure::{Measurement, measure};
    #[pymodule_export]
    use crate::scan::{Page, Scan, View, render};
    #[pymodule_export]
    use crate::scene::{Scene, load_scene};
    #[pymodule_export]
    use crate::table::Table;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        crate::own::note_process();
        let error = module.getattr("Error")?;
        error.setattr("file", module.py().None())?;
        error.setattr("hint", module.py().None())?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
