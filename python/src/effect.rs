//! A physical effect of a program's own: a gain as a function of the chirps.

use matdb::effects::{self, About, EffectParameter, Level, Shot, Stage, find};
use matdb::units::ratio_from_db;
use numpy::PyArray1;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::error::{UsageError, no_choice};
use crate::own::{self, dict_of};

/// Largest gain or loss, dB.
const MOST_DB: f64 = 300.0;
/// A visible change of a parameter, as a share of its range.
const STEP: f64 = 1.0 / 120.0;

/// A physical effect of one's own, for exploration: a gain in dB as a function of the chirps.
///
/// `diagnose` tries it beside those of the library, and `Scene.with_effects` renders it. The function is called from several
/// threads in turn, and gets some hundred chirps at once from `diagnose`, thousands of times, and one ray from `render` and
/// `compare`: that is slow. The gain of a chirp must not depend on the others. No file can declare such an effect, and it stays
/// in memory as long as the interpreter. It cannot itself render, fit or diagnose.
///
/// Parameters
/// ----------
/// name : str
///     Short name that no effect of the library has.
/// gain_db : callable
///     Takes the chirps, a `Shots`, and the values of the parameters by name. Gives the gain of each chirp, dB, or one for all;
///     -inf where no echo returns, and at most 300.
/// parameters : dict of str to tuple
///     The range of each parameter, `(low, high)`, in which 0 means that the effect is absent; or `(low, high, absent)`.
/// level : str, default "scene"
///     What has the effect: `instrument`, `material` or `scene`.
/// starts : list of dict, optional
///     Values that a search starts from, parameters that are not named being absent. Two steps of each parameter to both sides
///     unless stated; an effect with a place needs several.
/// uses_time : bool, default False
///     Whether the gain depends on the time of a chirp.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Effect {
    effect: &'static Own,
}

/// The chirps of which the gain of an effect is wanted, with arrays in their order.
#[pyclass(frozen, module = "matdb")]
pub(crate) struct Shots {
    shots: Vec<Shot>,
}

struct Own {
    about: About,
    starts: Vec<Vec<f64>>,
    gain_db: Py<PyAny>,
    uses_time: bool,
}

/// What a parameter of this name is measured in.
fn unit(name: &str) -> &'static str {
    let units = [("_db", "dB"), ("_deg", "deg"), ("_mm", "mm"), ("_m", "m"), ("_s", "s")];
    units.into_iter().find(|(end, _)| name.ends_with(end)).map_or("1", |(_, unit)| unit)
}

/// Text that lives as long as the program.
fn kept(text: &str) -> &'static str {
    text.to_owned().leak()
}

/// The values of all parameters, of those that are named.
fn values(parameters: &[EffectParameter], given: &Bound<'_, PyDict>) -> PyResult<Vec<f64>> {
    for (name, _) in given {
        let name: String = name.extract()?;
        if !parameters.iter().any(|known| known.name == name) {
            let known: Vec<&str> = parameters.iter().map(|known| known.name).collect();
            return Err(no_choice("parameter", &name, &known.join(", ")));
        }
    }
    let value = |&EffectParameter { name, min, max, absent, .. }: &EffectParameter| {
        let Some(given) = given.get_item(name)? else { return Ok(absent) };
        let value: f64 = given.extract()?;
        if (min..=max).contains(&value) {
            return Ok(value);
        }
        let problem = format!("{name} = {value} is out of range; give a value from {min} to {max}");
        Err(UsageError::new_err(problem))
    };
    parameters.iter().map(value).collect()
}

/// A parameter of its range, and of the value at which the effect is absent.
fn parameter(name: &str, range: &Bound<'_, PyAny>) -> PyResult<EffectParameter> {
    if !pyo3::types::PyString::new(range.py(), name).call_method0("isidentifier")?.extract()? {
        return Err(UsageError::new_err(format!("{name:?} is no name of an argument in Python")));
    }
    let numbers: Vec<f64> = range.extract().map_err(|_| {
        PyTypeError::new_err(format!("parameters[{name:?}] is (low, high) or (low, high, absent)"))
    })?;
    let (&[min, max] | &[min, max, _]) = &numbers[..] else {
        let problem = format!("parameters[{name:?}] has {} numbers, not 2 or 3", numbers.len());
        return Err(UsageError::new_err(problem));
    };
    let absent = numbers.get(2).copied().unwrap_or(0.0);
    if !(min.is_finite() && max.is_finite() && min < max && (min..=max).contains(&absent)) {
        return Err(UsageError::new_err(format!(
            "parameters[{name:?}] = {numbers:?} is no range with the value {absent} at which the effect is absent; give (low, high) \
             or (low, high, absent)"
        )));
    }
    let step = STEP * (max - min);
    Ok(EffectParameter { name: kept(name), unit: unit(name), min, max, absent, step })
}

/// Two steps of each parameter to both sides.
fn usual_starts(parameters: &[EffectParameter]) -> Vec<Vec<f64>> {
    let absent: Vec<f64> = parameters.iter().map(|known| known.absent).collect();
    let mut starts = Vec::new();
    for (place, known) in parameters.iter().enumerate() {
        for by in [-2.0, 2.0] {
            let mut start = absent.clone();
            start[place] = (known.absent + by * known.step).clamp(known.min, known.max);
            if start != absent {
                starts.push(start);
            }
        }
    }
    starts
}

/// Refuses an effect that has the name of an earlier one.
pub(crate) fn refuse_taken(
    name: &str,
    mut earlier: impl Iterator<Item = &'static str>,
) -> PyResult<()> {
    if earlier.any(|other| other == name) {
        let problem = format!("two effects are called {name}; give one another name");
        return Err(UsageError::new_err(problem));
    }
    Ok(())
}

impl Effect {
    /// The effect as the library takes it.
    pub(crate) fn effect(&self) -> &'static dyn effects::Effect {
        self.effect
    }

    /// The effect with the values of its parameters.
    pub(crate) fn with_values(
        &self,
        given: &Bound<'_, PyDict>,
    ) -> PyResult<(&'static dyn effects::Effect, Vec<f64>)> {
        Ok((self.effect, values(self.effect.about.parameters, given)?))
    }
}

#[pymethods]
impl Effect {
    #[new]
    #[pyo3(signature = (name, gain_db, parameters, *, level = "scene", starts = None, uses_time = false))]
    fn new(
        name: &str,
        gain_db: Bound<'_, PyAny>,
        parameters: &Bound<'_, PyAny>,
        level: &str,
        starts: Option<Vec<Bound<'_, PyAny>>>,
        uses_time: bool,
    ) -> PyResult<Effect> {
        let level = match level {
            "instrument" => Level::Instrument,
            "material" => Level::Material,
            "scene" => Level::Scene,
            other => return Err(no_choice("level", other, "instrument, material or scene")),
        };
        let slug: Result<matdb::material::Slug, String> = name.parse();
        slug.map_err(|problem| UsageError::new_err(problem.replace("material name", "name")))?;
        if find(name).is_some() {
            let problem = format!("the library has an effect `{name}`; take another name");
            return Err(UsageError::new_err(problem));
        }
        if !gain_db.is_callable() {
            return Err(PyTypeError::new_err(
                "gain_db is a function of the chirps and of the parameters",
            ));
        }
        let parameters = dict_of(parameters)?;
        if parameters.is_empty() {
            return Err(UsageError::new_err("an effect has at least one parameter"));
        }
        let mut known = Vec::new();
        for (name, range) in &parameters {
            known.push(parameter(name.extract()?, &range)?);
        }
        let starts = match starts {
            Some(starts) => starts
                .iter()
                .map(|start| values(&known, &dict_of(start)?))
                .collect::<PyResult<_>>()?,
            None => usual_starts(&known),
        };
        let about = About {
            name: kept(name),
            level,
            description: "An effect of a program's own.",
            signature: "What a function of a program says.",
            parameters: known.leak(),
            conflicts: &[],
            has_one_form: false,
        };
        let own = Own { about, starts, gain_db: gain_db.unbind(), uses_time };
        Ok(Effect { effect: Box::leak(Box::new(own)) })
    }

    /// Its name.
    #[getter]
    pub(crate) fn name(&self) -> &'static str {
        self.effect.about.name
    }

    fn __repr__(&self) -> String {
        let names: Vec<&str> =
            self.effect.about.parameters.iter().map(|known| known.name).collect();
        format!("<matdb.Effect {}({})>", self.name(), names.join(", "))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, Own { about, starts, gain_db, uses_time }) = (slf.py(), slf.get().effect);
        let ranges = PyDict::new(py);
        for EffectParameter { name, min, max, absent, .. } in about.parameters {
            ranges.set_item(name, (min, max, absent))?;
        }
        let mut named = Vec::new();
        for start in starts {
            let values = PyDict::new(py);
            for (known, value) in about.parameters.iter().zip(start) {
                values.set_item(known.name, value)?;
            }
            named.push(values);
        }
        let given = (about.name, gain_db, ranges, about.level.as_str(), named, uses_time);
        (slf.get_type().getattr("_of_parts")?, given).into_pyobject(py)
    }

    /// An effect of its parts, as pickle makes one.
    #[staticmethod]
    fn _of_parts(
        name: &str,
        gain_db: Bound<'_, PyAny>,
        parameters: &Bound<'_, PyAny>,
        level: &str,
        starts: Vec<Bound<'_, PyAny>>,
        uses_time: bool,
    ) -> PyResult<Effect> {
        Effect::new(name, gain_db, parameters, level, Some(starts), uses_time)
    }
}

impl Own {
    /// The gains of some chirps, as ratios.
    fn gains(&self, values: &[f64], shots: Vec<Shot>) -> Vec<f64> {
        let gains_db = own::called(|py| {
            let (count, named) = (shots.len(), PyDict::new(py));
            for (known, value) in self.about.parameters.iter().zip(values) {
                named.set_item(known.name, value)?;
            }
            let gains_db =
                own::levels_db(self.gain_db.bind(py), Shots { shots }, &named, (count, "chirps"))?;
            if gains_db.iter().any(|gain_db| gain_db.is_nan() || *gain_db > MOST_DB) {
                let name = self.about.name;
                let problem = format!(
                    "effect `{name}` gives NaN, or more than {MOST_DB} dB, with {named}; give gains in dB, and -inf for no echo"
                );
                return Err(UsageError::new_err(problem));
            }
            Ok(gains_db)
        });
        gains_db.into_iter().map(|db| ratio_from_db(db.max(-MOST_DB))).collect()
    }
}

impl effects::Effect for Own {
    fn about(&self) -> &About {
        &self.about
    }

    fn starts(&self, _: &Stage, _: &[Shot]) -> Vec<Vec<f64>> {
        self.starts.clone()
    }

    fn depends_on_time(&self) -> bool {
        self.uses_time
    }

    fn gain(&self, values: &[f64], _: &Stage, shot: &Shot) -> f64 {
        self.gains(values, vec![*shot]).into_iter().product()
    }

    fn multiply_gains(
        &self,
        values: &[f64],
        _: &Stage,
        shots: &[Option<&Shot>],
        gains: &mut [f64],
    ) {
        let hits: Vec<Shot> = shots.iter().flatten().map(|shot| **shot).collect();
        if hits.is_empty() {
            return;
        }
        let mut own = self.gains(values, hits).into_iter();
        for (gain, _) in gains.iter_mut().zip(shots).filter(|(_, shot)| shot.is_some()) {
            *gain *= own.next().unwrap_or(1.0);
        }
    }
}

/// Getters of a `Shots`: one array of a number of each chirp.
macro_rules! arrays {
    ($($(#[$about:meta])* $name:ident: $kind:ty = |$shot:ident| $number:expr;)+) => {
        #[pymethods]
        impl Shots {
            $(
                $(#[$about])*
                #[getter]
                fn $name<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<$kind>> {
                    PyArray1::from_iter(py, self.shots.iter().map(|$shot| $number))
                }
            )+

            fn __len__(&self) -> usize {
                self.shots.len()
            }

            fn __repr__(&self) -> String {
                format!("<matdb.Shots: {} chirps>", self.shots.len())
            }
        }
    };
}

arrays! {
    /// Chirp numbers.
    chirp: u32 = |shot| shot.chirp;
    /// Time of each chirp, s.
    time_s: f64 = |shot| shot.time_s;
    /// Share of the scan that is over, 0 to 1.
    progress: f64 = |shot| shot.progress;
    /// x in the target plane at 8 m, m.
    xt_m: f64 = |shot| shot.xt_m;
    /// y in the target plane at 8 m, m.
    yt_m: f64 = |shot| shot.yt_m;
    /// Where the ray meets the target, global frame, m.
    x_m: f64 = |shot| shot.hit.point.xyz.x;
    /// Where the ray meets the target, global frame, m.
    y_m: f64 = |shot| shot.hit.point.xyz.y;
    /// Where the ray meets the target, global frame, m.
    z_m: f64 = |shot| shot.hit.point.xyz.z;
    /// Way to there, m.
    range_m: f64 = |shot| shot.hit.range_m;
    /// Angle of incidence, degrees.
    theta_deg: f64 = |shot| shot.hit.theta_rad().to_degrees();
    /// Place of the region among `Scene.regions`.
    region: u16 = |shot| shot.region;
}
