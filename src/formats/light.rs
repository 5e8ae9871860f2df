//! Colours as light: files for viewers hold linear light where pictures hold sRGB.

/// Share of light, 0 to 1, of a part of a colour in sRGB (IEC 61966-2-1).
pub(super) fn light_of_srgb(part: u8) -> f32 {
    let share = f32::from(part) / 255.0;
    if share <= 0.040_45 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_follows_the_standard() {
        for (part, light) in [(0, 0.0), (10, 0.003_035), (128, 0.215_86), (255, 1.0)] {
            assert!((light_of_srgb(part) - light).abs() < 1e-5, "{part}");
        }
    }
}
