//! A sheet to draw on, in whole units of which a picture is [`WIDTH`] wide.

use plotters::backend::SVGBackend;
use plotters::coord::Shift;
use plotters::prelude::{
    Circle, DrawingArea, IntoDrawingArea, PathElement, Polygon, Rectangle, Text,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontStyle, IntoFont, RGBAColor, RGBColor, TextStyle};

use super::style::{BAR_WIDTH, CURVE_WIDTH, Look, Marker};

/// Units, and pixels of the PNG.
pub const WIDTH: i32 = 2_000;
/// The font that the binary carries.
pub const FONT: &str = "Roboto";
/// What the drawing library divides sizes by.
const LIBRARY_SIZE: f64 = 1.24;
/// Of the font's size: from the point that the drawing library is given down to the baseline.
const LIBRARY_DROP: f64 = 0.76;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

pub struct Canvas<'a> {
    area: Area<'a>,
}

/// Where a text stands relative to its point on the baseline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    Start,
    Middle,
    End,
}

/// Size in units, colour and weight of a text.
#[derive(Debug, Clone, Copy)]
pub struct Hand {
    pub size: i32,
    pub colour: RGBColor,
    pub bold: bool,
}

impl Canvas<'_> {
    /// Draws on a new sheet and gives its SVG.
    ///
    /// - errors: the drawing library's sentence.
    pub fn draw(
        height: i32,
        draw: impl FnOnce(&Canvas<'_>) -> Result<(), String>,
    ) -> Result<String, String> {
        let mut out = String::new();
        {
            let size = (WIDTH as u32, height as u32);
            let canvas =
                Canvas { area: SVGBackend::with_string(&mut out, size).into_drawing_area() };
            canvas.rectangle((0, 0), (WIDTH, height), RGBColor(255, 255, 255))?;
            draw(&canvas)?;
            canvas.area.present().map_err(|error| error.to_string())?;
        }
        Ok(out)
    }

    /// Writes on the baseline through `at`.
    pub fn text(
        &self,
        text: &str,
        (x, y): (i32, i32),
        side: Side,
        Hand { size, colour, bold }: Hand,
    ) -> Result<(), String> {
        let h_pos = match side {
            Side::Start => HPos::Left,
            Side::Middle => HPos::Center,
            Side::End => HPos::Right,
        };
        let weight = if bold { FontStyle::Bold } else { FontStyle::Normal };
        let font = (FONT, f64::from(size) * LIBRARY_SIZE).into_font();
        let style =
            TextStyle::from(font.style(weight)).color(&colour).pos(Pos::new(h_pos, VPos::Top));
        let drop = (f64::from(size) * LIBRARY_DROP).round() as i32;
        let element = Text::new(text.to_owned(), (x, y - drop), style);
        self.area.draw(&element).map_err(|error| error.to_string())
    }

    pub fn rectangle(
        &self,
        from: (i32, i32),
        to: (i32, i32),
        fill: RGBColor,
    ) -> Result<(), String> {
        let element = Rectangle::new([from, to], fill.filled());
        self.area.draw(&element).map_err(|error| error.to_string())
    }

    pub fn line(&self, points: &[(i32, i32)], colour: RGBColor, width: u32) -> Result<(), String> {
        assert!(width != CURVE_WIDTH, "only curves have the width of curves");
        self.path(points, colour, width)
    }

    /// A line of a condition, which gets the dashes of its look.
    pub fn curve(&self, points: &[(i32, i32)], look: Look) -> Result<(), String> {
        self.path(points, look.colour, CURVE_WIDTH)
    }

    fn path(&self, points: &[(i32, i32)], colour: RGBColor, width: u32) -> Result<(), String> {
        let element = PathElement::new(points.to_vec(), colour.stroke_width(width));
        self.area.draw(&element).map_err(|error| error.to_string())
    }

    /// A translucent area.
    pub fn band(&self, points: &[(i32, i32)], colour: RGBColor) -> Result<(), String> {
        self.polygon(points, colour.mix(0.15))
    }

    fn polygon(&self, points: &[(i32, i32)], colour: RGBAColor) -> Result<(), String> {
        let element = Polygon::new(points.to_vec(), colour.filled());
        self.area.draw(&element).map_err(|error| error.to_string())
    }

    pub fn marker(&self, (x, y): (i32, i32), look: Look) -> Result<(), String> {
        let (colour, r) = (look.colour, 13);
        match look.marker {
            Marker::Circle => self.dot((x, y), 12, colour),
            Marker::Square => self.rectangle((x - 11, y - 11), (x + 11, y + 11), colour),
            Marker::Triangle => {
                let corners = [(x, y - 15), (x + 14, y + 10), (x - 14, y + 10)];
                self.polygon(&corners, colour.to_rgba())
            }
            Marker::Diamond => {
                let corners = [(x, y - 16), (x + 14, y), (x, y + 16), (x - 14, y)];
                self.polygon(&corners, colour.to_rgba())
            }
            Marker::Cross => {
                self.line(&[(x - r, y - r), (x + r, y + r)], colour, CURVE_WIDTH + 1)?;
                self.line(&[(x - r, y + r), (x + r, y - r)], colour, CURVE_WIDTH + 1)
            }
            Marker::Ring => {
                self.dot((x, y), 14, colour)?;
                self.dot((x, y), 7, RGBColor(255, 255, 255))
            }
        }
    }

    fn dot(&self, at: (i32, i32), radius: i32, colour: RGBColor) -> Result<(), String> {
        let element = Circle::new(at, radius, colour.filled());
        self.area.draw(&element).map_err(|error| error.to_string())
    }

    /// A mean's spread.
    ///
    /// - `whole`: whether the low and the high end are those of the spread, which get a cap, and not
    ///   of the axis.
    pub fn spread(
        &self,
        x: i32,
        (low, high): (i32, i32),
        whole: (bool, bool),
        colour: RGBColor,
    ) -> Result<(), String> {
        // A line to where it begins is none: everybody agrees.
        if low != high {
            self.line(&[(x, low), (x, high)], colour, BAR_WIDTH)?;
        }
        for (y, is_end) in [(high, whole.1), (low, whole.0)] {
            if is_end {
                self.line(&[(x - 9, y), (x + 9, y)], colour, BAR_WIDTH)?;
            }
        }
        Ok(())
    }
}

/// About how wide a text is: good enough to put the next thing behind it.
pub fn width_of(text: &str, size: i32) -> i32 {
    let wide = |c: char| match c {
        'm' | 'w' | 'M' | 'W' | '%' | '—' => 0.86,
        'i' | 'l' | 'j' | 't' | 'f' | 'I' | '.' | ',' | ':' | ';' | ' ' | '-' => 0.29,
        c if c.is_ascii_uppercase() => 0.65,
        _ => 0.56,
    };
    (text.chars().map(wide).sum::<f64>() * f64::from(size)).ceil() as i32
}
