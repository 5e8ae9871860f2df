//! Promise: the orthogonal-distance fit agrees with an established program.
//!
//! The curve and the numbers come from `fixtures/orthogonal_distance.py`, which runs odrpack 0.7.0 (the
//! maintained ODRPACK95) with the weights below.

use matdb::brdf::{BlinnPhong, Brdf, CookTorrance, Distribution, Mixture, Shadowing};
use matdb::fit::{Fit, Method};
use matdb::measure::curve::Curve;

/// What odrpack finds.
const ODRPACK: [(&str, f64); 4] = [
    ("specular.m", 0.117950426),
    ("diffuse.alpha", 3.088798185),
    ("S", 4.955790268e-02),
    ("R", 3.987812957e-03),
];
const ODRPACK_SUM_OF_SQUARES: f64 = 387.839228523;

fn start() -> Brdf {
    let specular = CookTorrance {
        f_lambda: 0.1,
        m: 0.1,
        m_across: None,
        distribution: Distribution::Beckmann,
        shadowing: Shadowing::Separable,
    };
    let diffuse = Brdf::BlinnPhong(BlinnPhong { r_s: 0.02, alpha: 2.0 });
    let specular = Box::new(Brdf::CookTorrance(specular));
    Brdf::Mixture(Mixture { k: 0.3, diffuse: Box::new(diffuse), specular })
}

#[test]
fn parameters_agree_with_odrpack_to_a_ten_thousandth() {
    let curve = Curve::read(include_bytes!("fixtures/orthogonal_distance.csv")).unwrap();
    let method = Method::Tls { theta_sd_rad: 1f64.to_radians(), level_sd_db: 2.0 };
    let found = Fit { method, ..Fit::default() }.run(&start(), &curve).unwrap();
    assert!(found.converged && found.agreeing_starts >= 2, "{found:?}");
    for (name, expected) in ODRPACK {
        let value = found.estimate(name).unwrap().value;
        assert!((value / expected - 1.0).abs() < 1e-4, "{name}: {value} {expected}");
    }
    assert!((-2.0 * found.objective / ODRPACK_SUM_OF_SQUARES - 1.0).abs() < 1e-6, "{found:?}");
}
