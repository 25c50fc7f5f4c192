//! A drawn sheet as a finished SVG: with words for those who do not see it, dashes, and its font.

use apprentice::plain;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::html;

use super::canvas::FONT;
use super::style::{CURVE_WIDTH, LOOKS, hex};

pub const REGULAR: &[u8] = include_bytes!("../../data/fonts/Roboto-Regular.ttf");
pub const BOLD: &[u8] = include_bytes!("../../data/fonts/Roboto-Bold.ttf");

/// A figure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// The file's name without its ending.
    pub name: String,
    pub title: String,
    /// What it shows, for those who do not see it.
    pub description: String,
    svg: String,
}

impl Picture {
    /// - `drawn`: as the drawing library wrote it.
    pub(super) fn finish(name: &str, title: &str, description: &str, drawn: &str) -> Picture {
        let mut svg = drawn.to_owned();
        for look in LOOKS.iter().filter(|look| !look.dashes.is_empty()) {
            let stroke = format!("stroke=\"{}\" stroke-width=\"{CURVE_WIDTH}\"", hex(look.colour));
            let dashed = format!("{stroke} stroke-dasharray=\"{}\"", look.dashes);
            svg = svg.replace(&stroke, &dashed);
        }
        let (name, title) = (name.to_owned(), title.to_owned());
        Picture { name, title, description: description.to_owned(), svg }
    }

    /// For a page that has the font: see `font_faces`.
    pub fn inline(&self) -> String {
        let ids = (format!("{}-title", self.name), format!("{}-text", self.name));
        let (width, height) = size(&self.svg);
        let root = format!(
            "<svg viewBox=\"0 0 {width} {height}\" xmlns=\"http://www.w3.org/2000/svg\" \
             role=\"img\" aria-labelledby=\"{} {}\">\n<title id=\"{}\">{}</title>\n<desc \
             id=\"{}\">{}</desc>\n",
            ids.0,
            ids.1,
            ids.0,
            escaped(&self.title),
            ids.1,
            escaped(&self.description)
        );
        format!("{root}{}", self.body())
    }

    /// A file of its own, with the font in it.
    pub fn alone(&self) -> String {
        let (width, height) = size(&self.svg);
        format!(
            "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             xmlns=\"http://www.w3.org/2000/svg\" role=\"img\">\n<title>{}</title>\n<desc>{}</desc>\
             \n<style>{}</style>\n{}",
            escaped(&self.title),
            escaped(&self.description),
            font_faces(),
            self.body()
        )
    }

    /// As it was drawn: what the PNG is made of.
    pub(super) fn bare(&self) -> &str {
        &self.svg
    }

    fn body(&self) -> &str {
        self.svg.split_once('>').map_or("", |(_, body)| body.trim_start())
    }
}

/// The font as CSS, both weights.
pub fn font_faces() -> String {
    let face = |bytes: &[u8], weight: &str| {
        format!(
            "@font-face{{font-family:\"{FONT}\";font-weight:{weight};\
             src:url(data:font/ttf;base64,{})}}",
            STANDARD.encode(bytes)
        )
    };
    format!("{}{}", face(REGULAR, "normal"), face(BOLD, "bold"))
}

/// Text between tags or in quotes.
fn escaped(text: &str) -> String {
    html! { (plain::escape_lines(text)) }.into_string()
}

/// Width and height as the root says them.
fn size(svg: &str) -> (&str, &str) {
    let attribute = |name: &str| {
        let rest = svg.split_once(name).map_or("", |(_, rest)| rest);
        rest.split('"').next().unwrap_or("")
    };
    (attribute("width=\""), attribute("height=\""))
}
