//! The files of a case.

use std::fmt::Write;

use super::base::{Base, Slopes};
use super::noise::Detection;

/// `cloud.csv`.
pub fn cloud(detections: &[Detection]) -> String {
    let mut text = "chirp,x_m,y_m,z_m,range_m,power_dbm\n".to_owned();
    for Detection { chirp, point, range_m, power_dbm } in detections {
        let [x, y, z] = point.to_array();
        let _ = writeln!(text, "{chirp},{x:.6},{y:.6},{z:.6},{range_m:.6},{power_dbm:.4}");
    }
    text
}

/// `material.toml`: where a fit of the base law has to start.
pub fn material(start: &Base) -> String {
    let distribution = match start.slopes {
        Slopes::Beckmann => "beckmann",
        Slopes::Ggx => "ggx",
    };
    let Base { m, alpha, k, f_lambda, r_s, .. } = start;
    format!(
        r#"slug = "twin-surface"
name = "Surface of a twin"
class = "synthetic"
description = "A starting point, not a measurement: every parameter may be wrong by 30 %."
licence = "CC0-1.0"
tags = ["synthetic"]
frequency_ghz = [290, 310]
theta_deg = [0, 90]
render = "start"

[[source]]
key = "guess"
kind = "synthetic"
title = "Guess"

[[fit]]
name = "start"
estimator = "stated"
source = "guess"

[fit.scattering]
model = "mixture"
k = {k:.6}

[fit.scattering.specular]
model = "cook-torrance"
distribution = "{distribution}"
f_lambda = {f_lambda:.6}
m = {m:.6}

[fit.scattering.diffuse]
model = "blinn-phong"
r_s = {r_s:.6}
alpha = {alpha:.6}
"#
    )
}
