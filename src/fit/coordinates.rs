//! The coordinates of a search: the numbers of a model that backscatter determines, on scales that suit a search.
//!
//! Of the paper's mixture (12), (13), (15), backscatter sees m, α and the two levels
//! S = (1 − k)·f_λ and R = k·r_s, so that these are the coordinates, and the gauge says how k is
//! chosen. Any other model has the coordinates that [`Brdf::parameters`] lists. Levels and widths are
//! searched as logarithms. The looks L of the speckle are a coordinate too where they are not given.

use nalgebra::DVector;

use super::error::FitError;
use super::own_law::{OwnLaw, OwnParameter};
pub(crate) use super::settings::LOOKS;
use super::table::{Aspects, Table};
use crate::brdf::{Brdf, Mixture, Parameter, ParameterError};
use crate::radar::random::{Key, Purpose};

/// Name of the specular level S = (1 − k)·f_λ.
pub(crate) const SPECULAR_LEVEL: &str = "S";
/// Name of the diffuse level R = k·r_s.
pub(crate) const DIFFUSE_LEVEL: &str = "R";
/// Range of the levels: a lobe of m = 0.001 is a million times its level, and 10⁻¹² is then 60 dB below a mirror.
const LEVEL_RANGE: (f64, f64) = (1e-12, 1.0);
/// Range of the looks: from far stronger than fully developed speckle to practically no speckle.
const LOOKS_RANGE: (f64, f64) = (0.1, MOST_LOOKS);
/// Looks that are practically no speckle.
pub(super) const MOST_LOOKS: f64 = 1e4;

/// The scale on which a number is searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Scale {
    /// u = v.
    Linear,
    /// u = ln(v + offset).
    Log {
        /// Keeps zero in reach.
        offset: f64,
    },
    /// u = asinh v: logarithmic on both sides of zero.
    Asinh,
}

impl Scale {
    fn of_range(min: f64, max: f64) -> Scale {
        match min {
            _ if min > 0.0 && max >= 100.0 * min => Scale::Log { offset: 0.0 },
            0.0 if max > 1.0 => Scale::Log { offset: 1.0 },
            0.0 => Scale::Log { offset: 1e-6 },
            _ if min < 0.0 && max - min > 100.0 => Scale::Asinh,
            _ => Scale::Linear,
        }
    }

    fn searched(self, value: f64) -> f64 {
        match self {
            Scale::Linear => value,
            Scale::Log { offset } => (value + offset).ln(),
            Scale::Asinh => value.asinh(),
        }
    }

    fn value(self, searched: f64) -> f64 {
        match self {
            Scale::Linear => searched,
            Scale::Log { offset } => searched.exp() - offset,
            Scale::Asinh => searched.sinh(),
        }
    }

    fn slope(self, searched: f64) -> f64 {
        match self {
            Scale::Linear => 1.0,
            Scale::Log { .. } => searched.exp(),
            Scale::Asinh => searched.cosh(),
        }
    }
}

/// One number that a fit searches.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Coordinate {
    /// The parameter's path, `S`, `R` or `looks`.
    pub name: String,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    start: f64,
    scale: Scale,
}

impl Coordinate {
    fn new(name: &str, (min, max): (f64, f64), start: f64) -> Coordinate {
        let start = start.clamp(min, max);
        Coordinate { name: name.to_owned(), min, max, start, scale: Scale::of_range(min, max) }
    }

    /// The value at a point of the search, kept in its range.
    pub fn value(&self, searched: f64) -> f64 {
        self.scale.value(searched).clamp(self.min, self.max)
    }

    /// The bound that a value is nearer to.
    pub fn nearer_bound(&self, value: f64) -> f64 {
        if value - self.min < self.max - value { self.min } else { self.max }
    }

    /// Whether the coordinate is of the diffuse part of a mixture.
    fn is_diffuse(&self) -> bool {
        self.name.starts_with("diffuse.") || self.name == DIFFUSE_LEVEL
    }

    /// dv/du.
    pub fn slope(&self, searched: f64) -> f64 {
        self.scale.slope(searched)
    }

    /// Where a value lies in the search.
    pub fn searched(&self, value: f64) -> f64 {
        self.scale.searched(value)
    }

    /// Ends of the range in the search.
    pub fn ends(&self) -> [f64; 2] {
        [self.searched(self.min), self.searched(self.max)]
    }

    /// Ends of the range, in the search, in which a start is sought: of a permittivity those of dielectrics. Far beyond, all
    /// mirrors reflect alike, and a search finds no way back.
    pub fn usual_ends(&self) -> [f64; 2] {
        /// Permittivities of what hardly reflects, and of what reflects nearly all.
        const OF_MATTER: [f64; 2] = [1.02, 300.0];
        let [lower, upper] = self.ends();
        match self.scale {
            Scale::Asinh => {
                let [low, high] = OF_MATTER.map(|value| self.searched(value).clamp(lower, upper));
                // Bounds may leave out all of it.
                if low < high { [low, high] } else { [lower, upper] }
            }
            Scale::Linear | Scale::Log { .. } => [lower, upper],
        }
    }

    /// Ends of the range, in the search, over which a level that grows with the number grows all the way: of a
    /// permittivity those from 1 up. Below it a mirror reflects less with a larger one, or all.
    pub fn rising_ends(&self) -> [f64; 2] {
        let [lower, upper] = self.ends();
        match self.scale {
            Scale::Asinh if upper > self.searched(1.0) => [lower.max(self.searched(1.0)), upper],
            _ => [lower, upper],
        }
    }

    /// Largest distance of a drawn start from the given one.
    pub fn spread(&self) -> f64 {
        let [lower, upper] = self.ends();
        let most = match self.scale {
            Scale::Linear => 0.3 * (upper - lower),
            Scale::Log { .. } | Scale::Asinh => 1.5,
        };
        most.min(upper - lower)
    }
}

/// All numbers that a fit searches, and the model with its other numbers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Coordinates {
    /// In the order of the search.
    pub list: Vec<Coordinate>,
    base: Base,
    /// k of the mixture whose levels are searched as products.
    gauge: Option<f64>,
    looks: f64,
    /// Numbers that change a law only as another one does, each with that one: a search holds them.
    pub redundant: Vec<[usize; 2]>,
    /// Divergence of the beam that sees the model, rad.
    beam_rad: f64,
    /// Whether levels that no law can have, S + R > 1, are lowered together.
    lowers_levels: bool,
}

/// What the numbers are of.
#[derive(Clone, Debug, PartialEq)]
enum Base {
    Law(Brdf),
    /// With the value of each parameter, where it is not searched.
    Own(OwnLaw, Vec<f64>),
}

/// The frequencies in a law: they belong to the radar, so that a fit must not search them.
pub(crate) fn frequencies(law: &Brdf) -> Vec<(String, f64)> {
    law.parameters()
        .into_iter()
        .filter(|parameter| parameter.path.rsplit('.').next() == Some("frequency_hz"))
        .map(|parameter| (parameter.path, parameter.value))
        .collect()
}

impl Coordinates {
    /// The coordinates of a model; `fixed` parameters keep the values given there, `bounds` narrow ranges.
    /// Looks are searched for where `looks` is none.
    pub fn new(
        start: &Brdf,
        fixed: &[(String, f64)],
        bounds: &[(String, [f64; 2])],
        looks: Option<f64>,
    ) -> Result<Coordinates, FitError> {
        Coordinates::seen(start, fixed, bounds, looks, gauge)
    }

    /// The same for data of which source and receiver were in two directions: where a facet is met at an angle, its
    /// reflectance grows from f_lambda towards 1, so that a mixture has no gauge.
    ///
    /// # Errors
    /// As [`Coordinates::new`].
    pub fn of_pairs(
        start: &Brdf,
        fixed: &[(String, f64)],
        bounds: &[(String, [f64; 2])],
        looks: Option<f64>,
    ) -> Result<Coordinates, FitError> {
        Coordinates::seen(start, fixed, bounds, looks, |_, _| None)
    }

    fn seen(
        start: &Brdf,
        fixed: &[(String, f64)],
        bounds: &[(String, [f64; 2])],
        looks: Option<f64>,
        gauge: impl Fn(&Brdf, &[(String, f64)]) -> Option<f64>,
    ) -> Result<Coordinates, FitError> {
        start.validate()?;
        let mut base = start.clone();
        for (path, value) in fixed {
            if !base.set_parameter(path, *value) {
                return Err(FitError::UnknownParameter { name: path.clone() });
            }
        }
        base.validate()?;
        let gauge = gauge(&base, fixed);
        let list = base
            .parameters()
            .into_iter()
            .filter(|parameter| !is_fixed(fixed, &parameter.path))
            .filter_map(|parameter| coordinate(&base, gauge, &parameter));
        Coordinates::listed(list.collect(), Base::Law(base), bounds, looks, gauge)
    }

    /// The coordinates of a law of a program's own, as [`Coordinates::new`].
    ///
    /// # Errors
    /// As [`Coordinates::new`].
    pub fn of_own(
        law: &OwnLaw,
        fixed: &[(String, f64)],
        bounds: &[(String, [f64; 2])],
        looks: Option<f64>,
    ) -> Result<Coordinates, FitError> {
        let known = law.parameters();
        let mut values: Vec<f64> = known.iter().map(|parameter| parameter.start).collect();
        for (name, value) in fixed {
            let Some(place) = known.iter().position(|parameter| parameter.name == *name) else {
                return Err(FitError::UnknownParameter { name: name.clone() });
            };
            let OwnParameter { min, max, .. } = known[place];
            if !(min..=max).contains(value) {
                let (path, value) = (name.clone(), *value);
                return Err(ParameterError { path, value, min, max }.into());
            }
            values[place] = *value;
        }
        let free = known.iter().filter(|parameter| !is_fixed(fixed, &parameter.name));
        let list = free.map(|OwnParameter { name, min, max, start }| {
            Coordinate::new(name, (*min, *max), *start)
        });
        let base = Base::Own(law.clone(), values);
        Coordinates::listed(list.collect(), base, bounds, looks, None)
    }

    fn listed(
        mut list: Vec<Coordinate>,
        base: Base,
        bounds: &[(String, [f64; 2])],
        looks: Option<f64>,
        gauge: Option<f64>,
    ) -> Result<Coordinates, FitError> {
        if looks.is_none() {
            list.push(Coordinate::new(LOOKS, LOOKS_RANGE, 1.0));
        }
        for (name, range) in bounds {
            narrow(&mut list, name, *range)?;
        }
        Ok(Coordinates {
            list,
            base,
            gauge,
            looks: looks.unwrap_or(1.0),
            redundant: Vec::new(),
            beam_rad: 0.0,
            lowers_levels: false,
        })
    }

    /// The same coordinates of a model that a beam of this divergence sees, rad.
    pub fn seen_by(self, beam_rad: f64) -> Coordinates {
        Coordinates { beam_rad, ..self }
    }

    /// The same coordinates of a model that stays one whatever its levels: those that no law can have are lowered.
    pub fn lowering_levels(self) -> Coordinates {
        Coordinates { lowers_levels: true, ..self }
    }

    /// Number of coordinates.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// The start of the search.
    pub fn start(&self) -> DVector<f64> {
        self.vector(|c| c.searched(c.start))
    }

    /// A start drawn around that of the search; `number` from 1.
    pub fn drawn(&self, seed: u64, number: usize) -> DVector<f64> {
        let key = Key { seed, chirp: number as u64, sub_ray: 1, purpose: Purpose::Fit };
        let mut draws = key.draws();
        let mut start = self.start();
        for (u, coordinate) in start.iter_mut().zip(&self.list) {
            *u += coordinate.spread() * (2.0 * draws.uniform() - 1.0);
        }
        start
    }

    /// Lower ends of the ranges, in the search.
    pub fn lower(&self) -> DVector<f64> {
        self.vector(|c| c.ends()[0])
    }

    /// Upper ends of the ranges, in the search.
    pub fn upper(&self) -> DVector<f64> {
        self.vector(|c| c.ends()[1])
    }

    /// Both ends of the ranges, with redundant numbers held where they are.
    pub fn bounds(&self, at: &DVector<f64>) -> [DVector<f64>; 2] {
        let (mut lower, mut upper) = (self.lower(), self.upper());
        for &[index, _] in &self.redundant {
            (lower[index], upper[index]) = (at[index], at[index]);
        }
        [lower, upper]
    }

    /// The same, with the looks held as well.
    pub fn holding_looks(&self, at: &DVector<f64>) -> [DVector<f64>; 2] {
        let [mut lower, mut upper] = self.bounds(at);
        for index in (0..at.len()).filter(|&i| self.list.get(i).is_some_and(|c| c.name == LOOKS)) {
            (lower[index], upper[index]) = (at[index], at[index]);
        }
        [lower, upper]
    }

    fn vector(&self, value: impl Fn(&Coordinate) -> f64) -> DVector<f64> {
        DVector::from_iterator(self.len(), self.list.iter().map(value))
    }

    /// The values at a point of the search, in the order of [`list`](Self::list).
    pub fn values(&self, at: &DVector<f64>) -> Vec<f64> {
        self.list.iter().zip(at.iter()).map(|(c, &u)| c.value(u)).collect()
    }

    /// The looks at a point of the search.
    pub fn looks(&self, at: &DVector<f64>) -> f64 {
        let found = self.list.iter().zip(at.iter()).find(|(c, _)| c.name == LOOKS);
        found.map_or(self.looks, |(c, &u)| c.value(u))
    }

    /// The model at a point of the search.
    pub fn model(&self, at: &DVector<f64>) -> Brdf {
        let mut model = match &self.base {
            Base::Law(law) => law.clone(),
            Base::Own(law, values) => return law.at(&self.own_values(law, values, at)),
        };
        let mut levels = [0.0; 2];
        for (coordinate, value) in self.list.iter().zip(self.values(at)) {
            match coordinate.name.as_str() {
                SPECULAR_LEVEL => levels[0] = value,
                DIFFUSE_LEVEL => levels[1] = value,
                path => _ = model.set_parameter(path, value),
            }
        }
        if let Some(k) = self.gauge {
            let sum = levels[0] + levels[1];
            if self.lowers_levels && sum > 1.0 {
                // Not to exceed 1 by rounding.
                levels = levels.map(|level| (1.0 - 1e-12) * level / sum);
            }
            set_levels(&mut model, k, levels);
        }
        model
    }

    /// The values of all parameters of a law of a program's own.
    fn own_values(&self, law: &OwnLaw, values: &[f64], at: &DVector<f64>) -> Vec<f64> {
        let mut all = values.to_vec();
        for (coordinate, value) in self.list.iter().zip(self.values(at)) {
            let place = law.parameters().iter().position(|known| known.name == coordinate.name);
            if let Some(place) = place {
                all[place] = value;
            }
        }
        all
    }

    /// ln σ⁰ of the model at a point of the search, as the beam sees it.
    pub(super) fn table(&self, at: &DVector<f64>, aspects: &Aspects) -> Table {
        Table::new(&self.model(at), self.beam_rad, aspects)
    }

    /// Whether they are of a law of a program's own, whose names mean nothing here.
    pub fn is_own(&self) -> bool {
        matches!(self.base, Base::Own(..))
    }

    /// The chosen k, where backscatter does not determine it; `None` for a model without such a gauge.
    pub fn gauge(&self) -> Option<f64> {
        self.gauge
    }

    /// Whether the model is a mixture, and which of its coordinates are of its diffuse part.
    pub fn is_diffuse(&self) -> Option<Vec<bool>> {
        matches!(self.base, Base::Law(Brdf::Mixture(_)))
            .then(|| self.list.iter().map(Coordinate::is_diffuse).collect())
    }
}

/// k, where only the products of the paper's mixture can be found: neither level is fixed.
fn gauge(base: &Brdf, fixed: &[(String, f64)]) -> Option<f64> {
    let Brdf::Mixture(Mixture { k, .. }) = base else { return None };
    let inside = *k > 0.0 && *k < 1.0;
    let free = !is_fixed(fixed, "specular.f_lambda") && !is_fixed(fixed, "diffuse.r_s");
    let usable = base.identified_products().is_some() && free && (inside || !is_fixed(fixed, "k"));
    usable.then_some(if inside { *k } else { 0.5 })
}

fn is_fixed(fixed: &[(String, f64)], path: &str) -> bool {
    fixed.iter().any(|(name, _)| name == path)
}

fn coordinate(base: &Brdf, gauge: Option<f64>, parameter: &Parameter) -> Option<Coordinate> {
    let levels = base.identified_products().filter(|_| gauge.is_some());
    match (levels, parameter.path.as_str()) {
        (Some(_), "k") => None,
        (Some([s, _]), "specular.f_lambda") => {
            Some(Coordinate::new(SPECULAR_LEVEL, LEVEL_RANGE, s))
        }
        (Some([_, r]), "diffuse.r_s") => Some(Coordinate::new(DIFFUSE_LEVEL, LEVEL_RANGE, r)),
        (_, path) => Some(Coordinate::new(path, (parameter.min, parameter.max), parameter.value)),
    }
}

fn narrow(list: &mut [Coordinate], name: &str, [min, max]: [f64; 2]) -> Result<(), FitError> {
    let Some(coordinate) = list.iter_mut().find(|c| c.name == name) else {
        return Err(FitError::UnknownParameter { name: name.to_owned() });
    };
    if !(min < max && min >= coordinate.min && max <= coordinate.max) {
        let range = [coordinate.min, coordinate.max];
        return Err(FitError::Bounds { name: name.to_owned(), min, max, range });
    }
    *coordinate =
        Coordinate { min, max, start: coordinate.start.clamp(min, max), ..coordinate.clone() };
    Ok(())
}

/// Sets k, f_λ and r_s from S and R: k as near to the gauge's as f_λ ≤ 1 and r_s ≤ 1 allow.
fn set_levels(model: &mut Brdf, k: f64, [s, r]: [f64; 2]) {
    let k = if r <= 1.0 - s { k.clamp(r, 1.0 - s) } else { r / (r + s) };
    model.set_parameter("k", k);
    model.set_parameter("specular.f_lambda", s / (1.0 - k));
    model.set_parameter("diffuse.r_s", r / k);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Lambert, Scattering};
    use crate::fit::twin::mixture;

    fn names(coordinates: &Coordinates) -> Vec<&str> {
        coordinates.list.iter().map(|c| c.name.as_str()).collect()
    }

    #[test]
    fn a_mixture_is_searched_by_what_backscatter_sees() {
        let start = mixture(0.05, 6.0, 0.05, 0.002);
        let coordinates = Coordinates::new(&start, &[], &[], None).unwrap();
        assert_eq!(names(&coordinates), ["R", "diffuse.alpha", "S", "specular.m", "looks"]);
        let model = coordinates.model(&coordinates.start());
        for theta_rad in [0.0, 0.1, 0.5, 1.2] {
            let ratio = model.sigma0(theta_rad) / start.sigma0(theta_rad);
            assert!((ratio - 1.0).abs() < 1e-9, "{theta_rad}: {ratio}");
        }
    }

    #[test]
    fn the_gauge_gives_way_before_a_level_leaves_its_range() {
        let start = mixture(0.05, 6.0, 0.05, 0.002);
        let coordinates = Coordinates::new(&start, &[], &[], Some(1.0)).unwrap();
        let mut at = coordinates.start();
        for (u, c) in at.iter_mut().zip(&coordinates.list) {
            if c.name == "R" {
                *u = 0.7f64.ln();
            }
        }
        let model = coordinates.model(&at);
        model.validate().unwrap();
        assert!((model.identified_products().unwrap()[1] - 0.7).abs() < 1e-12);
    }

    #[test]
    fn a_level_by_hand_ends_the_gauge() {
        let start = mixture(0.05, 6.0, 0.05, 0.002);
        let fixed = [("specular.f_lambda".to_owned(), 0.056)];
        let coordinates = Coordinates::new(&start, &fixed, &[], Some(1.0)).unwrap();
        assert_eq!(coordinates.gauge(), None);
        assert_eq!(names(&coordinates), ["k", "diffuse.r_s", "diffuse.alpha", "specular.m"]);
    }

    #[test]
    fn every_scale_goes_there_and_back() {
        for (min, max) in [(0.0, 1.0), (0.0, 1000.0), (0.001, 2.0), (-1e6, 1e6), (0.5, 2.0)] {
            let scale = Scale::of_range(min, max);
            for share in [0.001, 0.3, 0.999] {
                let value = min + share * (max - min);
                let searched = scale.searched(value);
                assert!((scale.value(searched) - value).abs() < 1e-9 * (max - min), "{scale:?}");
                let slope = (scale.value(searched + 1e-6) - scale.value(searched - 1e-6)) / 2e-6;
                let error = scale.slope(searched) - slope;
                assert!(error.abs() < 1e-6 * slope.abs(), "{scale:?} {value}: {error}");
            }
        }
    }

    #[test]
    fn names_and_bounds_without_a_meaning_are_refused() {
        let start = Brdf::Lambert(Lambert { albedo: 0.3 });
        let unknown = Coordinates::new(&start, &[("m".to_owned(), 0.1)], &[], None);
        assert!(unknown.unwrap_err().to_string().contains("`m`"));
        let wide = [("albedo".to_owned(), [0.0, 2.0])];
        let message = Coordinates::new(&start, &[], &wide, None).unwrap_err().to_string();
        assert!(message.contains("albedo") && message.contains("from 0 to 1"), "{message}");
    }
}
