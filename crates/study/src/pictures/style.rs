//! How conditions look: colours that colour-blind people tell apart (Okabe and Ito, 2008), and for
//! those who print in grey a marker and a dash of their own.

use plotters::style::RGBColor;

pub const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
pub const SOFT: RGBColor = RGBColor(0x59, 0x59, 0x59);
pub const RULE: RGBColor = RGBColor(0xE2, 0xE2, 0xE2);
pub const AXIS: RGBColor = RGBColor(0x80, 0x80, 0x80);

/// The width of curves; nothing else is drawn with it, so that [`super::svg`] finds them.
pub const CURVE_WIDTH: u32 = 6;
pub const BAR_WIDTH: u32 = 3;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    Circle,
    Square,
    Triangle,
    Diamond,
    Cross,
    Ring,
}

/// How one condition is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Look {
    pub colour: RGBColor,
    pub marker: Marker,
    /// As SVG's `stroke-dasharray`; empty for a line without gaps.
    pub dashes: &'static str,
}

/// In the order of conditions; after the last they begin again.
pub const LOOKS: [Look; 6] = [
    Look { colour: RGBColor(0x00, 0x72, 0xB2), marker: Marker::Circle, dashes: "" },
    Look { colour: RGBColor(0xD5, 0x5E, 0x00), marker: Marker::Square, dashes: "26 12" },
    Look { colour: RGBColor(0x00, 0x9E, 0x73), marker: Marker::Triangle, dashes: "6 10" },
    Look { colour: RGBColor(0xCC, 0x79, 0xA7), marker: Marker::Diamond, dashes: "26 10 6 10" },
    Look { colour: RGBColor(0x56, 0xB4, 0xE9), marker: Marker::Cross, dashes: "14 8" },
    Look { colour: RGBColor(0xE6, 0x9F, 0x00), marker: Marker::Ring, dashes: "40 10" },
];

pub fn look(number: usize) -> Look {
    LOOKS[number % LOOKS.len()]
}

pub fn hex(colour: RGBColor) -> String {
    format!("#{:02X}{:02X}{:02X}", colour.0, colour.1, colour.2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_look_differs_from_every_other_in_each_way() {
        for (index, one) in LOOKS.iter().enumerate() {
            for other in &LOOKS[index + 1..] {
                assert_ne!(one.colour, other.colour);
                assert_ne!(one.marker, other.marker);
                assert_ne!(one.dashes, other.dashes);
            }
        }
        assert_eq!(look(LOOKS.len()), LOOKS[0]);
        assert_eq!(hex(LOOKS[0].colour), "#0072B2");
    }
}
