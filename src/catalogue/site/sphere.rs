//! A sphere of a material as the preset radar sees it.

use std::fmt::Write;

use super::levels::range_deg;
use crate::brdf::{Brdf, Scattering, widening_rad};
use crate::formats::figure::Scale;
use crate::formats::figure::ticks::ticks;
use crate::formats::words::{decibels, fixed};
use crate::frames::Direction;
use crate::material::Material;
use crate::radar::{GaussianBeam, Link, Radar};
use crate::units::dbm_from_watts;

/// Powers at the ends of the colours, dBm, the same for all materials. A mirror returns less than the upper one.
const COLOURS_DBM: [f64; 2] = [-110.0, 0.0];
/// Centre and radius of the sphere in the drawing, px.
const CENTRE: f64 = 106.0;
const RADIUS: f64 = 100.0;
/// Left edge, width, top and height of the bar of colours, px.
const BAR: [f64; 4] = [238.0, 16.0, 12.0, 188.0];
/// Colours of the bar.
const BAR_STEPS: u32 = 22;

/// What one ring of the sphere returns.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Return {
    /// Received power, dBm.
    Power(f64),
    /// The material claims nothing at this angle.
    NotClaimed,
}

/// The drawing of the sphere, seen along the beam at the distance of the focus: colours are the received power, and
/// a ring's title its angle and its power. None of a material that renders nothing.
pub(super) fn svg(material: &Material) -> Option<String> {
    let law = material.scattering().ok()?;
    let radar = Radar::default();
    let ball = Ball::new(material, &law, &radar);
    let mut svg = format!(
        "<svg class=\"ball\" viewBox=\"0 0 312 212\" role=\"img\" aria-labelledby=\"ball-title ball-text\">\
         <title id=\"ball-title\">A sphere of this material</title>\
         <desc id=\"ball-text\">Received power over a sphere, {}.</desc>\
         <g transform=\"translate({CENTRE} {CENTRE})\">",
        ball.in_words()
    );
    let rings = ball.rings();
    let mut crossings = Vec::new();
    for (number, ring) in rings.iter().enumerate() {
        // Rings lie on each other, the widest lowest.
        if number > 0 && rings[number - 1].is_seen(&radar) != ring.is_seen(&radar) {
            crossings.push(ring.to_rad);
        }
        svg += &ring.svg();
    }
    for theta_rad in crossings {
        let radius = RADIUS * theta_rad.sin();
        let _ = write!(svg, "<circle class=\"threshold\" r=\"{radius:.1}\"/>");
    }
    svg += "</g>";
    svg += &bar(radar.threshold_dbm);
    Some(svg + "</svg>")
}

/// A sphere of a material in the beam of a radar.
struct Ball<'a> {
    law: &'a Brdf,
    link: Link,
    beam: GaussianBeam,
    range_m: f64,
    /// How far the beam widens the lobes of the law, rad.
    widening_rad: f64,
    claimed_deg: [f64; 2],
}

/// One colour of the sphere: a circle that reaches to an angle.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ring {
    /// Angles at its inner and its outer edge, rad.
    from_rad: f64,
    to_rad: f64,
    back: Return,
}

impl Ball<'_> {
    fn new<'a>(material: &Material, law: &'a Brdf, radar: &Radar) -> Ball<'a> {
        let link = Link::new(radar);
        let beam = link.beam.towards(0.0, 0.0);
        let seen_lobe_rad = material.rendered_lobes().seen_lobe_rad(law);
        Ball {
            law,
            range_m: radar.frames().pattern_range_m,
            widening_rad: widening_rad(seen_lobe_rad, beam.divergence_rad()),
            link,
            beam,
            claimed_deg: range_deg(material),
        }
    }

    /// Equation (11), as the renderer has it.
    fn power_dbm(&self, theta_rad: f64) -> f64 {
        let to_radar = Direction::from_angles(theta_rad, 0.0);
        let f_per_sr = self.law.seen_by(self.widening_rad, to_radar, to_radar).f_per_sr;
        dbm_from_watts(self.link.power_w(&self.beam, self.range_m, theta_rad.cos(), f_per_sr))
    }

    fn back(&self, theta_deg: f64) -> Return {
        // Claimed angles come back from radians a little off.
        const ROUNDING_DEG: f64 = 1e-5;
        let [least, most] = self.claimed_deg;
        if theta_deg < least - ROUNDING_DEG || theta_deg > most + ROUNDING_DEG {
            return Return::NotClaimed;
        }
        Return::Power(self.power_dbm(theta_deg.to_radians()))
    }

    /// From the rim to the middle.
    fn rings(&self) -> Vec<Ring> {
        let mut rings: Vec<Ring> = Vec::new();
        for [from_deg, to_deg] in EDGES_DEG {
            let width_deg = if to_deg > 12.0 {
                2.0
            } else if to_deg > 3.0 {
                0.5
            } else {
                0.25
            };
            let steps = ((to_deg - from_deg) / width_deg) as u32;
            for step in 0..steps {
                let inner_deg = from_deg + f64::from(step) * width_deg;
                rings.push(Ring {
                    from_rad: inner_deg.to_radians(),
                    to_rad: (inner_deg + width_deg).to_radians(),
                    back: self.back(inner_deg + 0.5 * width_deg),
                });
            }
        }
        rings.reverse();
        rings
    }

    fn in_words(&self) -> String {
        let at = [0.0, 10.0, 30.0, 60.0].into_iter().filter_map(|deg| match self.back(deg) {
            Return::Power(dbm) if dbm.is_finite() => {
                Some(format!("{} dBm at {deg:.0}°", decibels(dbm)))
            }
            _ => None,
        });
        at.collect::<Vec<_>>().join(", ")
    }
}

/// Parts of the sphere with rings of one width, °: narrow where lobes are.
const EDGES_DEG: [[f64; 2]; 3] = [[0.0, 3.0], [3.0, 12.0], [12.0, 90.0]];

impl Ring {
    /// Whether its echo passes the threshold of a radar.
    fn is_seen(&self, radar: &Radar) -> bool {
        matches!(self.back, Return::Power(dbm) if dbm >= radar.threshold_dbm)
    }

    fn svg(&self) -> String {
        let radius = RADIUS * self.to_rad.sin();
        let circle = format!("<circle r=\"{radius:.1}\"");
        let middle_deg = (0.5 * (self.from_rad + self.to_rad)).to_degrees();
        let angle = fixed(middle_deg, if middle_deg < 12.0 { 1 } else { 0 });
        match self.back {
            Return::Power(dbm) if dbm.is_finite() => {
                let colour = colour(dbm);
                let dbm = decibels(dbm);
                format!("{circle} fill=\"{colour}\"><title>{angle}°: {dbm} dBm</title></circle>")
            }
            Return::Power(_) => {
                format!(
                    "{circle} fill=\"{}\"><title>{angle}°: nothing</title></circle>",
                    colour(COLOURS_DBM[0])
                )
            }
            Return::NotClaimed => {
                format!(
                    "{circle} class=\"unclaimed\"><title>{angle}°: not claimed</title></circle>"
                )
            }
        }
    }
}

fn colour(dbm: f64) -> String {
    let [low, high] = COLOURS_DBM;
    let [red, green, blue] = Scale::Sequential.colour_at((dbm - low) / (high - low));
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Where a power stands on the bar, px from the top of the drawing.
fn down(dbm: f64) -> f64 {
    let ([_, _, top, height], [low, high]) = (BAR, COLOURS_DBM);
    top + height * (high - dbm) / (high - low)
}

/// The colours with their powers, and the threshold of the radar.
fn bar(threshold_dbm: f64) -> String {
    let [left, width, ..] = BAR;
    let [low, high] = COLOURS_DBM;
    let mut svg = String::new();
    let step_dbm = (high - low) / f64::from(BAR_STEPS);
    for step in 0..BAR_STEPS {
        let dbm = high - f64::from(step) * step_dbm;
        let (y, tall, fill) =
            (down(dbm), down(dbm - step_dbm) - down(dbm), colour(dbm - 0.5 * step_dbm));
        let _ = write!(
            svg,
            "<rect x=\"{left}\" y=\"{y:.1}\" width=\"{width}\" height=\"{tall:.2}\" fill=\"{fill}\"/>"
        );
    }
    for tick in ticks(low, high, 6) {
        let (x, y, label) = (left + width + 6.0, down(tick.value) + 4.0, tick.label);
        let _ = write!(svg, "<text x=\"{x}\" y=\"{y:.1}\">{label}</text>");
    }
    let (y, right) = (down(threshold_dbm), left + width);
    let start = left - 8.0;
    let _ = write!(svg, "<path class=\"threshold\" d=\"M{start} {y:.1}H{right}\"/>");
    svg
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::builtin;

    #[test]
    fn a_lambert_sphere_falls_with_the_cosines_of_equation_11_and_mirrors_return_no_more_than_was_sent()
     {
        let radar = Radar::default();
        let paint = builtin::get("mannequin-paint").unwrap().unwrap();
        let law = Brdf::Lambert(crate::brdf::Lambert { albedo: 0.5 });
        let ball = Ball::new(&paint, &law, &radar);
        let fall_db = ball.power_dbm(0.0) - ball.power_dbm(1.0);
        assert!((fall_db - 20.0 * (1.0 / 1f64.cos()).log10()).abs() < 1e-9, "{fall_db}");
        for name in builtin::names() {
            let material = builtin::get(name).unwrap().unwrap();
            let law = material.scattering().unwrap();
            let ball = Ball::new(&material, &law, &radar);
            let most_dbm = radar.transmit_power_dbm - radar.system_loss_db;
            assert!(ball.power_dbm(0.0) <= most_dbm + 0.1 && most_dbm < COLOURS_DBM[1], "{name}");
        }
    }

    #[test]
    fn rings_reach_from_the_rim_to_the_middle_without_a_gap_and_name_their_power() {
        let paint = builtin::get("mannequin-paint").unwrap().unwrap();
        let law = paint.scattering().unwrap();
        let rings = Ball::new(&paint, &law, &Radar::default()).rings();
        assert!(rings.windows(2).all(|pair| (pair[0].from_rad - pair[1].to_rad).abs() < 1e-12));
        assert!(
            (rings[0].to_rad.to_degrees() - 90.0).abs() < 1e-9
                && rings.last().unwrap().from_rad == 0.0
        );
        assert_eq!(rings[0].back, Return::NotClaimed, "it is claimed up to 80°");
        let svg = svg(&paint).unwrap();
        assert!(
            svg.len() < 8_000 && svg.contains("not claimed") && svg.contains("class=\"threshold\""),
            "{}",
            svg.len()
        );
        assert!(!svg.contains("style"), "no page has a style of its own");
    }
}
