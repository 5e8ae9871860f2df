//! Promise: the nearest materials are those that a look at every single one finds, in the same order and
//! at the same distances, though most are only looked at in outline.

use matdb::brdf::{Brdf, Tabulated};
use matdb::catalogue::{Distance, Nearest, Probe, Rank};
use matdb::material::{Curve, Illumination, Material, Observation, Slug, builtin};
use matdb::radar::random::{Draws, Key, Purpose};
use matdb::store::{Filter, Store};
use matdb::units::ratio_from_db;

const MATERIALS: usize = 300;

fn draws(number: usize) -> Draws {
    Key { seed: 5, chirp: number as u64, sub_ray: 0, purpose: Purpose::Speckle }.draws()
}

fn within(draws: &mut Draws, low: f64, high: f64) -> f64 {
    low + (high - low) * draws.uniform()
}

fn at(theta_deg: f64, level_db: f64, is_detected: bool) -> Observation {
    let (theta_rad, level) = (theta_deg.to_radians(), ratio_from_db(level_db));
    let (sigma0, limit) = (is_detected.then_some(level), (!is_detected).then_some(level));
    Observation::backscatter(theta_rad, sigma0, limit)
}

/// A material of its own: another lobe, or a rugged curve that falls silent.
fn material(number: usize) -> Material {
    let mut draws = draws(number);
    let mut material = builtin::get("mannequin-paint").unwrap().unwrap();
    material.slug = format!("material-{number:04}").parse().unwrap();
    material.theta_rad[1] = within(&mut draws, 0.3, 1.5);
    material.class = format!("class-{}", number % 3);
    if number % 10 == 9 {
        // Equal to the one before.
        return Material { slug: material.slug, ..self::material(number - 1) };
    }
    if number % 4 == 3 {
        let mut points: Vec<f64> = (0..40).map(|_| within(&mut draws, 0.0, 50.0)).collect();
        points.sort_by(f64::total_cmp);
        let level = |deg: &f64| at(*deg, within(&mut draws, -40.0, 5.0), true);
        let mut observations: Vec<Observation> = points.iter().map(level).collect();
        observations.push(at(50.0, -40.0, false));
        let source = material.sources[0].key.clone();
        material.curves = vec![Curve {
            name: "scan".to_owned(),
            source,
            instrument: None,
            session: None,
            illumination: Illumination::default(),
            observations,
        }];
        material.render = "scan".to_owned();
        return material;
    }
    let render = material.render.clone();
    let fit = material.fits.iter_mut().find(|fit| fit.name == render).unwrap();
    fit.covariance = None;
    for parameter in fit.model.parameters() {
        let low = parameter.min.max(1e-3);
        let value = within(&mut draws, low, parameter.max.min(5.0).max(low));
        assert!(fit.model.set_parameter(&parameter.path, value));
    }
    material
}

fn filled() -> Store {
    let mut store = Store::in_memory().unwrap();
    let built_in = builtin::names().map(|name| builtin::get(name).unwrap().unwrap());
    let all: Vec<Material> = built_in.chain((0..MATERIALS).map(material)).collect();
    store.add(&all).unwrap();
    store
}

/// Looks at every material.
fn exhaustive(probe: &Probe, store: &Store, filter: &Filter, rank: Rank, most: usize) -> Nearest {
    let mut found: Vec<(Slug, Distance)> = Vec::new();
    let mut left_out = 0;
    for summary in store.find(filter).unwrap() {
        let rendered = store.rendered(&summary.slug).unwrap();
        match rendered.and_then(|(model, theta_rad)| probe.distance(&model, theta_rad)) {
            Some(distance) => found.push((summary.slug, distance)),
            None => left_out += 1,
        }
    }
    let far = |distance: &Distance| distance.rank_db(rank);
    found.sort_by(|a, b| far(&a.1).total_cmp(&far(&b.1)).then_with(|| a.0.cmp(&b.0)));
    found.truncate(most);
    Nearest { found, left_out, damaged: Vec::new() }
}

/// A curve like that of some material, with scatter, repeats, and what lies below a threshold.
fn probe(store: &Store, number: usize) -> Option<Probe> {
    let mut draws = draws(100_000 + number);
    let slug = format!("material-{:04}", number * 7 % MATERIALS).parse().unwrap();
    let (model, _): (Brdf, _) = store.rendered(&slug).unwrap().unwrap();
    let threshold_db = within(&mut draws, -60.0, 0.0);
    let (points, scatter_db) = (3 + number % 60, within(&mut draws, 0.0, 4.0));
    let offset_db = within(&mut draws, -10.0, 10.0);
    let most_deg = within(&mut draws, 5.0, 60.0);
    let observation = |_| {
        let theta_deg = within(&mut draws, 0.0, most_deg);
        let theta_deg = if number.is_multiple_of(2) { theta_deg.round() } else { theta_deg };
        let level = matdb::brdf::Scattering::sigma0(&model, theta_deg.to_radians());
        let scatter = within(&mut draws, -scatter_db, scatter_db);
        let level_db = (10.0 * level.log10()).max(-70.0) + offset_db + scatter;
        at(theta_deg, level_db.max(threshold_db), level_db > threshold_db)
    };
    Probe::new(&(0..points).map(observation).collect::<Vec<_>>())
}

#[test]
fn the_nearest_are_those_that_looking_at_every_one_finds() {
    let store = filled();
    let class = Filter { class: Some("class-1".to_owned()), ..Filter::default() };
    let mut compared = 0;
    for number in 0..60 {
        let Some(probe) = probe(&store, number) else { continue };
        for (filter, rank, most) in [
            (&Filter::default(), Rank::Level, 10),
            (&Filter::default(), Rank::Shape, 10),
            (&Filter::default(), Rank::Level, 1),
            (&class, Rank::Level, 25),
            (&class, Rank::Shape, 1000),
            (&class, Rank::Level, 0),
        ] {
            let found = probe.nearest(&store, filter, rank, most).unwrap();
            assert_eq!(found, exhaustive(&probe, &store, filter, rank, most), "{number} {rank:?}");
            compared += found.found.len();
        }
    }
    assert!(compared > 8_000, "{compared} is too little to say anything");
}

#[test]
fn a_line_of_an_outline_that_is_not_of_its_material_is_damage() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sqlite");
    let mut store = Store::open(&path).unwrap();
    store.add(&[material(1), material(2)]).unwrap();
    assert_eq!(store.damage().unwrap(), Vec::<String>::new());
    drop(store);
    let conn = rusqlite::Connection::open(&path).unwrap();
    for sql in [
        "UPDATE outline SET levels = zeroblob(180) WHERE slug = 'material-0001'",
        "UPDATE outline SET model_hash = (SELECT model_hash FROM outline WHERE slug = 'material-0002')",
        "UPDATE outline SET theta_max_rad = 0.1 WHERE slug = 'material-0001'",
        "DELETE FROM outline WHERE slug = 'material-0001'",
    ] {
        conn.execute_batch(sql).unwrap();
        let store = Store::open_existing(&path).unwrap().unwrap();
        let damage = store.damage().unwrap();
        assert!(damage.len() == 1 && damage[0].contains("`material-0001`"), "{sql}: {damage:?}");
    }
}

#[test]
fn a_curve_that_cannot_be_outlined_is_looked_at_in_full() {
    let rugged = Tabulated::new(&[(0.1, 1.0), (0.1001, 100.0), (0.5, 0.1)]).unwrap();
    let sum = matdb::brdf::Sum { parts: vec![Brdf::Tabulated(rugged)] };
    assert_eq!(matdb::brdf::Outline::new(&Brdf::Sum(sum)), None);
}
