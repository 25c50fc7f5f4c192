//! Figures and the report of a finished study, drawn from its tables alone.
//!
//! The same tables give the same bytes: text is set in a font that the binary carries, and nothing
//! here asks a clock or a path. Every figure says in itself whether its users were simulated.

mod about;
mod canvas;
mod chart;
mod figures;
mod html;
mod png;
mod scale;
mod shares;
mod style;
mod svg;
#[cfg(test)]
mod tests;

use std::io;
use std::path::{Path, PathBuf};

pub use about::{About, AboutError, Condition, Users};
pub use svg::Picture;

use crate::measures::Tables;

/// The report's file in a study's directory.
pub const REPORT_FILE: &str = "report.html";

/// Why there are no pictures.
#[derive(Debug, thiserror::Error)]
pub enum DrawError {
    #[error("{} cannot be written: {error}", path.display())]
    Write { path: PathBuf, error: io::Error },
    #[error("the figure {name} cannot be drawn: {reason}")]
    Figure { name: String, reason: String },
}

/// Draws every figure that the tables have numbers for, as SVG and PNG, and the report.
///
/// - `out`: a directory that exists; files of the same names are replaced.
/// - returns: what was written, the report last.
/// - errors: a file that cannot be written, or a figure that cannot be drawn.
pub fn draw(tables: &Tables, about: &About, out: &Path) -> Result<Vec<PathBuf>, DrawError> {
    let pictures = pictures(tables, about)?;
    let mut written = Vec::new();
    let mut write = |name: String, bytes: &[u8]| {
        let path = out.join(name);
        std::fs::write(&path, bytes)
            .map_err(|error| DrawError::Write { path: path.clone(), error })?;
        written.push(path);
        Ok::<(), DrawError>(())
    };
    for picture in &pictures {
        let bytes = png::render(picture)
            .map_err(|reason| DrawError::Figure { name: picture.name.clone(), reason })?;
        write(format!("{}.svg", picture.name), picture.alone().as_bytes())?;
        write(format!("{}.png", picture.name), &bytes)?;
    }
    write(REPORT_FILE.to_owned(), html::page(tables, about, &pictures).as_bytes())?;
    Ok(written)
}

/// The figures that the tables have numbers for, in the order of the report.
pub fn pictures(tables: &Tables, about: &About) -> Result<Vec<Picture>, DrawError> {
    let figures = [
        ("general", figures::general(tables, about)),
        ("case-study", figures::case_study(tables, about)),
        ("task-types", figures::by_task_type(tables, about)),
        ("first-try", figures::first_try(tables, about)),
        ("answered-by", shares::answered(tables, about)),
    ];
    let mut drawn = Vec::new();
    for (name, figure) in figures {
        drawn.extend(figure.map_err(|reason| DrawError::Figure { name: name.to_owned(), reason })?);
    }
    Ok(drawn)
}
