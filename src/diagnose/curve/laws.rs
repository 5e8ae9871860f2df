//! Other scattering models, with which a curve is compared before any term: a lobe of another shape must not come out as
//! an effect.

use crate::brdf::{
    BlinnPhong, Brdf, CookTorrance, Correlation, Distribution, Kirchhoff, Lambert, Parameter,
    Shadowing, Sum,
};
use crate::fit::model;

/// Models by name, with values from which a search starts.
const BY_NAME: [&str; 5] = ["mixture", "mixture-ggx", "kirchhoff-go", "kirchhoff", "directive"];
/// Two lobes over Lambert.
const TWO_LOBES: [(&str, [Distribution; 2]); 3] = [
    ("two GGX lobes over Lambert", [Distribution::Ggx, Distribution::Ggx]),
    ("a Beckmann and a GGX lobe over Lambert", [Distribution::Beckmann, Distribution::Ggx]),
    ("two Beckmann lobes over Lambert", [Distribution::Beckmann, Distribution::Beckmann]),
];

/// Every other model than the declared one with its name.
pub(super) fn other_laws(declared: &Brdf) -> Vec<(&'static str, Brdf)> {
    let named = BY_NAME.into_iter().filter_map(|name| Some((name, model(name)?)));
    let two = TWO_LOBES.into_iter().map(|(name, [narrow, wide])| {
        let parts = vec![flat(), lobe(narrow, 0.08), lobe(wide, 0.4)];
        (name, Brdf::Sum(Sum { parts }))
    });
    let diffuse = Brdf::BlinnPhong(BlinnPhong { r_s: 0.05, alpha: 5.0 });
    let diffuse = Brdf::Sum(Sum { parts: vec![flat(), diffuse] });
    let exponential = model("kirchhoff").and_then(with_exponential_correlation);
    let exponential = exponential.map(|law| ("kirchhoff with exponential correlation", law));
    let over_lambert =
        [("one GGX lobe over Lambert", base_law()), ("a diffuse lobe over Lambert", diffuse)];
    let all = named.chain(over_lambert).chain(two).chain(exponential);
    all.filter(|(_, law)| !is_same_form(law, declared)).collect()
}

/// Whether two models differ in their numbers only.
fn is_same_form(a: &Brdf, b: &Brdf) -> bool {
    let mut a = a.clone();
    for Parameter { path, value, .. } in b.parameters() {
        if !a.set_parameter(&path, value) {
            return false;
        }
    }
    a == *b
}

/// Kirchhoff's law of heights whose correlation has no curvature at its peak, as machined and natural surfaces have it.
fn with_exponential_correlation(law: Brdf) -> Option<Brdf> {
    let Brdf::Kirchhoff(surface) = law else { return None };
    Some(Brdf::Kirchhoff(Kirchhoff { correlation: Correlation::Exponential, ..surface }))
}

/// The default scattering model: one GGX lobe over Lambert, with values to start from.
pub fn base_law() -> Brdf {
    Brdf::Sum(Sum { parts: vec![flat(), lobe(Distribution::Ggx, 0.3)] })
}

fn flat() -> Brdf {
    Brdf::Lambert(Lambert { albedo: 0.1 })
}

fn lobe(distribution: Distribution, m: f64) -> Brdf {
    let shadowing = Shadowing::Separable;
    Brdf::CookTorrance(CookTorrance { f_lambda: 0.05, m, m_across: None, distribution, shadowing })
}
