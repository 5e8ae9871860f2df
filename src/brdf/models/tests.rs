use super::*;
use crate::brdf::Distribution;
use proptest::prelude::*;

fn every_isotropic_model() -> Vec<Brdf> {
    let cook_torrance = |distribution, shadowing| CookTorrance {
        f_lambda: 0.3,
        m: 0.2,
        m_across: None,
        distribution,
        shadowing,
    };
    let blinn_phong = BlinnPhong { r_s: 0.2, alpha: 3.0 };
    let beckmann = cook_torrance(Distribution::Beckmann, Shadowing::Separable);
    let mut models = vec![
        Brdf::Lambert(Lambert { albedo: 0.7 }),
        Brdf::BlinnPhong(blinn_phong),
        Brdf::Tabulated(Tabulated::new(&[(0.0, 2.0), (0.3, 0.1), (1.2, 0.01)]).unwrap()),
        Brdf::Mixture(Mixture {
            k: 0.4,
            diffuse: Box::new(Brdf::BlinnPhong(blinn_phong)),
            specular: Box::new(Brdf::CookTorrance(beckmann)),
        }),
    ];
    models.push(Brdf::Sum(Sum { parts: models.clone() }));
    models.extend(smooth_models());
    models.extend(rough_models());
    for distribution in [Distribution::Beckmann, Distribution::Ggx] {
        for shadowing in [Shadowing::Separable, Shadowing::Correlated] {
            models.push(Brdf::CookTorrance(cook_torrance(distribution, shadowing)));
        }
    }
    models
}

pub(in crate::brdf) fn every_model() -> Vec<Brdf> {
    let mut models = every_isotropic_model();
    models.extend(anisotropic_models());
    for (name, json) in Brdf::KINDS.iter().flat_map(|kind| kind.starts) {
        models.push(serde_json::from_str(json).expect(name));
    }
    models
}

fn smooth_models() -> Vec<Brdf> {
    let (eps_real, eps_imag, lobe_rad) = (4.67, 5.0, Some(0.1));
    let layers = vec![Layer { thickness_m: 3e-4, eps_real: 2.6, eps_imag: 0.1 }];
    let frequency_hz = 300e9;
    vec![
        Brdf::Fresnel(Fresnel { eps_real, eps_imag, lobe_rad }),
        Brdf::Layered(Layered { layers, eps_real, eps_imag, frequency_hz, lobe_rad }),
        Brdf::Fresnel(Fresnel { eps_real, eps_imag, lobe_rad: None }),
    ]
}

fn rough_models() -> Vec<Brdf> {
    let (eps_real, eps_imag, lobe_rad, frequency_hz) = (4.67, 5.0, Some(0.1), 300e9);
    let kirchhoff = |rms_height_m, correlation| {
        let correlation_length_m = 1e-3;
        Brdf::Kirchhoff(Kirchhoff {
            rms_height_m,
            correlation_length_m,
            correlation,
            eps_real,
            eps_imag,
            frequency_hz,
            lobe_rad,
        })
    };
    vec![
        kirchhoff(5e-5, Correlation::Gaussian),
        kirchhoff(3e-4, Correlation::Gaussian),
        kirchhoff(5e-5, Correlation::Exponential),
        Brdf::KirchhoffGo(KirchhoffGo { rms_slope: 0.2, eps_real, eps_imag }),
        Brdf::Directive(Directive { s: 0.4, alpha_r: 4.0, lambda: 1.0, alpha_i: 1.0 }),
        Brdf::Directive(Directive { s: 0.4, alpha_r: 30.0, lambda: 0.6, alpha_i: 2.5 }),
    ]
}

fn anisotropic_models() -> Vec<Brdf> {
    let brushed = |distribution| {
        let shadowing = Shadowing::Correlated;
        let (m, m_across) = (0.1, Some(0.4));
        Brdf::CookTorrance(CookTorrance { f_lambda: 0.9, m, m_across, distribution, shadowing })
    };
    vec![brushed(Distribution::Beckmann), brushed(Distribution::Ggx)]
}

proptest! {
    #[test]
    fn every_model_is_reciprocal_finite_and_not_negative(
        ti in 0.0f64..1.57, to in 0.0f64..1.57, pi in -3.1f64..3.1, po in -3.1f64..3.1,
    ) {
        let (i, o) = (Direction::from_angles(ti, pi), Direction::from_angles(to, po));
        for model in every_model() {
            let (there, back) = (model.f_per_sr(i, o), model.f_per_sr(o, i));
            prop_assert!(there >= 0.0 && there.is_finite(), "{model:?}: {there}");
            prop_assert!((there - back).abs() <= 1e-12 * there.abs(), "{model:?}");
        }
    }

    #[test]
    fn every_model_without_a_grain_is_isotropic(ti in 0.0f64..1.5, to in 0.0f64..1.5, turn in -3.0f64..3.0) {
        for model in every_isotropic_model() {
            let f = |azimuth: f64| model.f_per_sr(
                Direction::from_angles(ti, azimuth),
                Direction::from_angles(to, azimuth + 1.0),
            );
            prop_assert!((f(0.0) - f(turn)).abs() <= 1e-9 * f(0.0).abs());
        }
    }
}

#[test]
fn the_specular_share_is_that_of_the_powers() {
    let i = Direction::from_angles(0.2, 0.0);
    let Brdf::Mixture(mixture) = every_model().remove(3) else { panic!("not the mixture") };
    let specular = 0.6 * mixture.specular.f_per_sr(i, i);
    let expected = specular / mixture.f_per_sr(i, i);
    assert!(expected > 0.1 && expected < 0.9, "{expected}");
    assert!((mixture.specular_share(i, i) - expected).abs() < 1e-12);
    let parts = vec![Brdf::Mixture(mixture.clone()), Brdf::Lambert(Lambert { albedo: 0.7 })];
    let sum = Sum { parts };
    let expected = specular / sum.f_per_sr(i, i);
    assert!((sum.specular_share(i, i) - expected).abs() < 1e-12);
}

#[test]
fn the_enum_answers_as_the_model_by_itself() {
    for model in every_model() {
        for (theta_i, theta_o, azimuth) in [(0.0, 0.0, 0.0), (0.2, 0.2, 0.0), (0.4, 1.1, 2.0)] {
            let i = Direction::from_angles(theta_i, 0.3);
            let o = Direction::from_angles(theta_o, 0.3 + azimuth);
            let alone = model.model();
            assert_eq!(model.f_per_sr(i, o), alone.f_per_sr(i, o), "{model:?}");
            let shares = [model.seen_by(0.02, i, o), alone.seen_by(0.02, i, o)];
            assert_eq!(shares[0], shares[1], "{model:?}");
            assert_eq!(model.specular_share(i, o), alone.specular_share(i, o), "{model:?}");
            assert_eq!(model.sigma0(theta_i), alone.sigma0(theta_i), "{model:?}");
        }
        assert_eq!(model.backscatter(), model.model().backscatter(), "{model:?}");
        assert_eq!(model.is_smooth(), model.model().is_smooth(), "{model:?}");
        assert_eq!(model.permittivity(), model.model().permittivity(), "{model:?}");
        assert_eq!(model.f_lambda(), model.model().f_lambda(), "{model:?}");
        assert_eq!(model.has_curve(), model.model().has_curve(), "{model:?}");
        let mirrors = [model.has_smooth_mirror(), model.model().has_smooth_mirror()];
        assert_eq!(mirrors[0], mirrors[1], "{model:?}");
    }
}

/// What is wrapped in the enum and what is not must not differ in what reflects like a mirror.
#[test]
fn models_of_facets_are_specular_by_themselves() {
    let i = Direction::from_angles(0.2, 0.0);
    let share = |model: &dyn Scattering| model.specular_share(i, i);
    for model in every_model() {
        match &model {
            Brdf::CookTorrance(model) => assert_eq!(share(model), 1.0),
            Brdf::Fresnel(model) => assert_eq!(share(model), 1.0),
            Brdf::Layered(model) => assert_eq!(share(model), 1.0),
            Brdf::Kirchhoff(model) => assert_eq!(share(model), 1.0),
            Brdf::KirchhoffGo(model) => assert_eq!(share(model), 1.0),
            Brdf::Mixture(model) => assert!(share(model) > 0.0 && share(model) < 1.0),
            Brdf::Sum(model) => assert!(share(model) > 0.0 && share(model) < 1.0),
            Brdf::Lambert(model) => assert_eq!(share(model), 0.0),
            _ => {}
        }
    }
}

/// The keys of a kind are those that its models are written with, in that order.
#[test]
fn every_kind_has_its_name_and_its_keys() {
    let mut seen = Vec::new();
    for model in every_model() {
        let json = serde_json::to_string(&model).unwrap();
        let name = json.split('"').nth(3).unwrap();
        let kind = Brdf::KINDS.iter().find(|kind| kind.name == name).unwrap();
        seen.push(kind.name);
        let written = serde_json::to_value(&model).unwrap();
        let written = written.as_object().unwrap();
        let required = kind.keys.iter().filter(|key| key.required);
        assert!(required.clone().all(|key| written.contains_key(key.name)), "{json}");
        let is_known = |key: &&String| kind.keys.iter().any(|known| known.name == **key);
        assert_eq!(written.keys().filter(is_known).count(), written.len() - 1, "{json}");
        for parameter in model.parameters() {
            let (key, _) = parameter.path.split_once('.').unwrap_or((&parameter.path, ""));
            let is_part = key.parse::<usize>().is_ok();
            assert!(is_part || written.contains_key(key), "{}", parameter.path);
        }
    }
    for kind in Brdf::KINDS {
        assert!(seen.contains(&kind.name), "give every_model one of `{}`", kind.name);
    }
}

#[test]
fn nothing_is_scattered_below_the_horizon() {
    let (up, down) = (Direction::from_angles(0.3, 0.0), Direction::from_angles(2.0, 0.0));
    for model in every_model() {
        assert_eq!(model.f_per_sr(up, down), 0.0);
        assert_eq!(model.f_per_sr(down, up), 0.0);
    }
}

#[test]
fn parameters_can_be_read_set_and_checked_by_path() {
    let mut model = every_model().remove(3);
    let paths: Vec<_> = model.parameters().into_iter().map(|p| p.path).collect();
    assert_eq!(paths, ["k", "diffuse.r_s", "diffuse.alpha", "specular.f_lambda", "specular.m"]);
    assert!(model.set_parameter("specular.m", 0.0));
    assert!(!model.set_parameter("specular.n", 0.1));
    let message = model.validate().unwrap_err().to_string();
    assert!(message.contains("specular.m = 0"), "{message}");
}

#[test]
fn models_survive_json() {
    for model in every_model() {
        let text = serde_json::to_string(&model).unwrap();
        let back: Brdf = serde_json::from_str(&text).unwrap();
        for theta_rad in [0.0, 0.1, 0.5, 1.0, 1.4] {
            let (a, b) = (model.sigma0(theta_rad), back.sigma0(theta_rad));
            assert!((a - b).abs() <= 1e-12 * a, "{text}");
        }
    }
}
