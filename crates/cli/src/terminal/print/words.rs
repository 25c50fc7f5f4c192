//! Words and sentences put together.

/// The same words without repetitions, each where it stood first.
pub fn unique<'w>(words: impl Iterator<Item = &'w str>) -> Vec<&'w str> {
    let mut found: Vec<&str> = Vec::new();
    for word in words {
        if !found.contains(&word) {
            found.push(word);
        }
    }
    found
}

/// `"a", "b" and "c"`.
pub fn quoted(words: &[&str]) -> String {
    let words: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).collect();
    listed(&words)
}

/// `a, b and c`.
pub fn listed<S: AsRef<str>>(parts: &[S]) -> String {
    let mut out = String::new();
    for (index, part) in parts.iter().enumerate() {
        out.push_str(match index {
            0 => "",
            _ if index + 1 == parts.len() => " and ",
            _ => ", ",
        });
        out.push_str(part.as_ref());
    }
    out
}

/// Several lines as one, for a program that reads line by line.
pub fn one_line(lines: &[String]) -> String {
    let mut joined = String::new();
    for line in lines.iter().map(|line| line.trim()) {
        let starts_sentence = line.starts_with(char::is_uppercase);
        let gap = match joined.chars().last() {
            None => "",
            Some('.' | ':' | '!' | '?') => " ",
            Some(_) if starts_sentence => ". ",
            Some(_) => "; ",
        };
        joined.push_str(gap);
        joined.push_str(line);
    }
    joined
}

/// A clause as a sentence of its own: with a capital and a full stop.
pub fn sentence(clause: &str) -> String {
    let mut chars = clause.chars();
    let first = chars.next().map(|c| c.to_uppercase().to_string()).unwrap_or_default();
    let stop = if clause.ends_with('.') { "" } else { "." };
    format!("{first}{}{stop}", chars.as_str())
}

/// A reason that goes on in another sentence.
pub fn without_stop(sentence: &str) -> &str {
    sentence.trim_end_matches('.')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_lines_become_one_without_losing_their_ends() {
        let lines = ["What I did:", "  1  a", "  2  b", "Which was it?"].map(str::to_owned);
        assert_eq!(one_line(&lines), "What I did: 1  a; 2  b. Which was it?");
    }
}
