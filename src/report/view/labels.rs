//! What the columns of a cloud are, in words.

/// Name of a column, what it is, and its unit.
const LABELS: [(&str, &str, &str); 24] = [
    ("power_dbm", "received power", "dBm"),
    ("before_dbm", "predicted power without effects", "dBm"),
    ("after_dbm", "predicted power with the effects", "dBm"),
    ("residual_before_db", "residual without effects", "dB"),
    ("residual_after_db", "residual with the effects", "dB"),
    ("unknown_db", "unknown power that the model lacks", "dB"),
    ("range_m", "range", "m"),
    ("range_residual_m", "range residual with the effects", "m"),
    ("true_range_m", "range of the mesh", "m"),
    ("xt_m", "x in the target plane", "m"),
    ("yt_m", "y in the target plane", "m"),
    ("incidence_deg", "incidence angle", "°"),
    ("incidence_sd_deg", "spread of the incidence angle over the spot", "°"),
    ("azimuth_deg", "azimuth of the radar about the normal", "°"),
    ("edge_m", "distance to the nearest edge in depth", "m"),
    ("specular_share", "share of the power that is specular", ""),
    ("phase_rad", "phase of the beat", "rad"),
    ("time_s", "time of the chirp", "s"),
    ("chirp", "chirp number", ""),
    ("rank", "return number in the chirp, 1 the strongest", ""),
    ("surfaces", "surfaces on the path", ""),
    ("sheets", "sheets in front", ""),
    ("passed_db", "power that sheets let through", "dB"),
    ("facet", "facet number", ""),
];

/// What a column is, and its unit; its name where nothing is known of it.
pub(super) fn label(name: &str) -> (&str, &'static str) {
    let known = LABELS.iter().find(|(known, ..)| *known == name);
    known.map_or((name, ""), |(_, label, unit)| (label, unit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{COLOURS, cloud_table};

    #[test]
    fn columns_of_a_rendering_say_what_they_are() {
        for column in cloud_table(&[], &[], &[], &[], true).columns {
            let name = column.name.as_str();
            let plain = ["x", "y", "z", "region", "material"].into_iter().chain(COLOURS);
            assert!(plain.into_iter().any(|one| one == name) || label(name).0 != name, "{name}");
        }
        assert_eq!(label("after_dbm"), ("predicted power with the effects", "dBm"));
    }
}
