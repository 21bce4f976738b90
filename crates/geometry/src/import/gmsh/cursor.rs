//! Reads the numbers and lines of a .msh file, ASCII or binary, one after the other.

use crate::import::{ImportError, ImportProblem, shown_word};

/// A file, and how far it has been read.
pub(super) struct Cursor<'a> {
    /// The whole file.
    bytes: &'a [u8],
    /// The number of bytes that have been read.
    at: usize,
    /// The name of the file, for messages.
    file: &'a str,
    /// `None` in an ASCII file. In a binary one, whether its numbers have their most significant byte first.
    binary: Option<bool>,
}

impl<'a> Cursor<'a> {
    /// The beginning of a file, whose numbers are text until [`Self::binary`] is called.
    pub(super) fn new(bytes: &'a [u8], file: &'a str) -> Self {
        Self { bytes, at: 0, file, binary: None }
    }

    /// An error of this file.
    pub(super) fn fail(&self, problem: ImportProblem) -> ImportError {
        ImportError::new(self.file, problem)
    }

    /// An error at the present place of the file.
    pub(super) fn malformed(&self, what: impl Into<String>) -> ImportError {
        let place = if self.binary.is_some() {
            format!("byte {}", self.at)
        } else {
            format!("line {}", 1 + self.bytes[..self.at].iter().filter(|&&b| b == b'\n').count())
        };
        self.fail(ImportProblem::Malformed { place, what: what.into() })
    }

    /// Whether numbers are binary.
    pub(super) fn is_binary(&self) -> bool {
        self.binary.is_some()
    }

    /// Switches to binary numbers. The next number must be a 1, whose bytes show the byte order.
    pub(super) fn binary(&mut self) -> Result<(), ImportError> {
        let swapped = match i32::from_le_bytes(self.raw()?) {
            1 => false,
            0x0100_0000 => true,
            _ => return Err(self.malformed("the number 1 that shows the byte order is missing")),
        };
        self.binary = Some(swapped);
        Ok(())
    }

    /// The number of items that a `count` in the file may reserve memory for: at most as many as the rest of
    /// the file can hold, if an item takes at least `text` bytes in an ASCII file and `binary` bytes in a
    /// binary one.
    pub(super) fn room(&self, count: u64, text: usize, binary: usize) -> usize {
        let rest = (self.bytes.len() - self.at) / if self.is_binary() { binary } else { text };
        usize::try_from(count).unwrap_or(usize::MAX).min(rest)
    }

    /// The next line that is not blank, trimmed; `None` at the end.
    pub(super) fn line(&mut self) -> Option<&'a [u8]> {
        while self.at < self.bytes.len() {
            let rest = &self.bytes[self.at..];
            let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
            self.at = (self.at + length + 1).min(self.bytes.len());
            let line = rest[..length].trim_ascii();
            if !line.is_empty() {
                return Some(line);
            }
        }
        None
    }

    /// Skips the rest of a section and its line `$End...`.
    pub(super) fn skip(&mut self, section: &str) -> Result<(), ImportError> {
        let end = format!("$End{section}");
        let rest = &self.bytes[self.at..];
        let place = rest.windows(end.len()).position(|w| w == end.as_bytes());
        let Some(place) = place else { return Err(self.malformed(format!("no {end}"))) };
        self.at += place + end.len();
        Ok(())
    }

    /// Reads the line `$End...`, which must be next.
    pub(super) fn end(&mut self, section: &str) -> Result<(), ImportError> {
        match self.line() {
            Some(line) if line.strip_prefix(b"$End") == Some(section.as_bytes()) => Ok(()),
            _ => Err(self.malformed(format!("no $End{section} where the section should end"))),
        }
    }

    /// The next word of an ASCII file.
    fn token(&mut self) -> Result<&'a str, ImportError> {
        let rest = &self.bytes[self.at..];
        let begin = rest.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(rest.len());
        let rest = &rest[begin..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if length == 0 || rest[0] == b'$' {
            return Err(self.malformed("a number is missing"));
        }
        let token = std::str::from_utf8(&rest[..length]).map_err(|_| self.malformed("not a number"))?;
        self.at += begin + length;
        Ok(token)
    }

    /// The next number of an ASCII file.
    fn parsed<T: std::str::FromStr>(&mut self) -> Result<T, ImportError> {
        let token = self.token()?;
        token.parse().map_err(|_| {
            let short = shown_word(token.as_bytes());
            self.malformed(format!("{short} is not a number, or not one that may stand here"))
        })
    }

    /// The next bytes of a binary file, the least significant one first.
    fn raw<const N: usize>(&mut self) -> Result<[u8; N], ImportError> {
        let bytes = self.bytes[self.at..].first_chunk::<N>().copied();
        let mut bytes = bytes.ok_or_else(|| self.malformed("the file ends too early"))?;
        self.at += N;
        if self.binary == Some(true) {
            bytes.reverse();
        }
        Ok(bytes)
    }

    /// An integer, of four bytes in a binary file.
    pub(super) fn int(&mut self) -> Result<i64, ImportError> {
        if self.is_binary() { Ok(i64::from(i32::from_le_bytes(self.raw()?))) } else { self.parsed() }
    }

    /// A count or tag, of eight bytes in a binary file.
    pub(super) fn size(&mut self) -> Result<u64, ImportError> {
        if self.is_binary() { Ok(u64::from_le_bytes(self.raw()?)) } else { self.parsed() }
    }

    /// A finite number, of eight bytes in a binary file.
    pub(super) fn real(&mut self) -> Result<f64, ImportError> {
        let value: f64 = if self.is_binary() { f64::from_le_bytes(self.raw()?) } else { self.parsed()? };
        if value.is_finite() { Ok(value) } else { Err(self.malformed(format!("{value} is not finite"))) }
    }
}
