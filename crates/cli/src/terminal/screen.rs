use std::io::{self, Write};

use apprentice::plain;

use super::print;

/// How much the reader wants to see.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// A person at a screen: several lines, progress and hints.
    Screen,
    /// A program reading line by line: each answer is one line, and nothing else is said.
    Lines,
}

/// Where the conversation is shown.
pub struct Screen<'a> {
    out: &'a mut dyn Write,
    style: Style,
}

impl<'a> Screen<'a> {
    pub fn new(out: &'a mut dyn Write, style: Style) -> Screen<'a> {
        Screen { out, style }
    }

    pub fn style(&self) -> Style {
        self.style
    }

    /// One thing to tell: a block on a screen, one line for a program.
    pub fn tell(&mut self, lines: &[String]) -> io::Result<()> {
        match self.style {
            Style::Screen => self.report(lines),
            Style::Lines => self.report(&[print::one_line(lines)]),
        }
    }

    /// A report that was asked for, line by line in any style.
    pub fn report(&mut self, lines: &[String]) -> io::Result<()> {
        for line in lines {
            writeln!(self.out, "{}", plain::escape(line))?;
        }
        self.out.flush()
    }

    /// Something only a person at a screen wants to know.
    pub fn hint(&mut self, line: &str) -> io::Result<()> {
        match self.style {
            Style::Screen => self.report(&[line.to_owned()]),
            Style::Lines => Ok(()),
        }
    }
}
