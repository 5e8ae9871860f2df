//! Cook–Torrance against the rough conductor of another renderer.

use std::collections::BTreeMap;

use matdb::brdf::{CookTorrance, Distribution, Scattering, Shadowing};
use matdb::frames::{Direction, Surface};

use super::page::{Row, Section, Table, Tolerance::Below};

/// The reference computes in single precision (6e-8 a step). In the tails an exponent of up to 40
/// multiplies the rounding of its argument.
const SINGLE_PRECISION: f64 = 1e-4;

const FIXTURE: &str = include_str!("../fixtures/rough-conductor.csv");

#[derive(serde::Deserialize)]
struct Reference {
    distribution: Distribution,
    alpha_u: f64,
    alpha_v: f64,
    theta_i_rad: f64,
    phi_i_rad: f64,
    theta_o_rad: f64,
    phi_o_rad: f64,
    d_per_sr: f64,
    f_per_sr: f64,
}

impl Reference {
    fn directions(&self) -> [Direction<Surface>; 2] {
        [(self.theta_i_rad, self.phi_i_rad), (self.theta_o_rad, self.phi_o_rad)]
            .map(|(theta_rad, phi_rad)| Direction::from_angles(theta_rad, phi_rad))
    }

    /// Relative differences of D and of f.
    fn errors(&self) -> [f64; 2] {
        let [i, o] = self.directions();
        let h = Direction::new(i.xyz() + o.xyz()).unwrap();
        let model = CookTorrance {
            f_lambda: 1.0,
            m: self.alpha_u,
            m_across: (self.alpha_u != self.alpha_v).then_some(self.alpha_v),
            distribution: self.distribution,
            shadowing: Shadowing::Separable,
        };
        let d = match model.m_across {
            None => self.distribution.d_per_sr(h.cos_theta(), model.m),
            Some(across) => self.distribution.d_anisotropic_per_sr(h, [model.m, across]),
        };
        [d / self.d_per_sr - 1.0, model.f_per_sr(i, o) / self.f_per_sr - 1.0].map(f64::abs)
    }
}

fn references() -> Vec<Reference> {
    csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(FIXTURE.as_bytes())
        .deserialize()
        .map(Result::unwrap)
        .collect()
}

/// Name of the group, then how many and the worst of D and f.
fn groups() -> BTreeMap<String, (usize, [f64; 2])> {
    let mut groups = BTreeMap::new();
    for reference in references() {
        let grain =
            if reference.alpha_u == reference.alpha_v { "isotropic" } else { "with a grain" };
        let law = match reference.distribution {
            Distribution::Beckmann => "Beckmann",
            Distribution::Ggx => "GGX",
        };
        let name = format!("{law}, {grain}");
        let group: &mut (usize, [f64; 2]) = groups.entry(name).or_default();
        group.0 += 1;
        let errors = reference.errors();
        group.1 = [0, 1].map(|term| group.1[term].max(errors[term]));
    }
    groups
}

pub fn section() -> Section {
    let groups = groups();
    assert_eq!(groups.values().map(|group| group.0).sum::<usize>(), 200);
    let row = |(name, (count, errors)): (&String, &(usize, [f64; 2]))| {
        let of = |term: &str| format!("{name}, {count} pairs: worst relative difference of {term}");
        [(of("D"), errors[0]), (of("f"), errors[1])]
            .map(|(what, error)| Row::new(what, error, Below(SINGLE_PRECISION)))
    };
    let text = "`cook-torrance` (separable, f_λ = 1) against the plugin `roughconductor` of Mitsuba 3.9.1 (variant \
                `scalar_rgb`, material `none`, so that F = 1), for roughness 0.05 to 0.7, backscatter, pairs near the \
                mirror direction and any two directions. `tests/fixtures/rough-conductor.py` made the values in \
                `tests/fixtures/rough-conductor.csv`; the renderer is not needed to run the test. D is the slope \
                distribution; f checks Smith's G as well. The reference has single precision, and the \
                exponents of the tails multiply its rounding by up to 40: hence 1e-4."
        .to_owned();
    let tables = vec![Table { text, rows: groups.iter().flat_map(row).collect() }];
    let not_covered = vec![
        "Schlick's F and the correlated shadowing against another program: Mitsuba 3 has neither in its rough conductor.",
    ];
    Section { title: "Microfacets against another renderer", tables, not_covered }
}
