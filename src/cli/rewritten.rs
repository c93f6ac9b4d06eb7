//! The text of a scenario with other claims: only what changes is replaced, and comments, ends of lines and all else stay.

use std::ops::Range;

use avastra_lang::model::Avoidability;
use avastra_lang::model::vocabulary::{RECURRENCE, Word};
use avastra_lang::syntax::ast::{self, ClauseKind, Doc, Expect, ExprKind, FileId, Span};

/// The subject of a claim: its kind, and the number of the obstacle or the requirement.
type About<'a> = (&'a str, Option<&'a str>);

/// The kind of claims about a recurrence from a moment on.
const FROM_A_MOMENT: &str = "recurrence at";

/// A scenario's file with these `fields` of its origin taken from another text of it. The other text's claims replace the
/// refuted ones. Everything else stays: other claims, comments, ends of lines.
pub fn rewritten(text: &str, anew: &str, is_refuted: &[bool], fields: &[&str]) -> String {
    let (old_file, new_file) = (parsed(text), parsed(anew));
    let (Some((old, old_docs)), Some((new, new_docs))) = (scenario_of(&old_file), scenario_of(&new_file))
    else {
        return text.to_owned();
    };
    let mut edits: Vec<(Range<usize>, String)> = Vec::new();
    for name in fields {
        edits.extend(field_edit(name, (text, old), (anew, new)));
    }
    edits.extend(claim_edits((text, &old.expects), (anew, &new.expects), is_refuted));
    // The sentence above it tells of the crash, unless the author wrote another one.
    if let ([old], [new]) = (old_docs, new_docs)
        && is_refuted.contains(&true)
        && old.text.contains(" is hit at ")
    {
        edits.push((range(old.span), anew[range(new.span)].to_owned()));
    }
    edited(text, edits)
}

/// A scenario's file with the claims `anew` about the recurrence of a finding from moments on. They replace the claims of this kind
/// that it has. `whom` is the number of the road user, or the requirement. A claim without `with` is about the finding, too. `None`
/// if the file claims nothing.
pub fn with_moments(text: &str, whom: &str, anew: &[String]) -> Option<String> {
    let file = parsed(text);
    let (scenario, _) = scenario_of(&file)?;
    let claims: Vec<(About, Range<usize>)> =
        scenario.expects.iter().map(|expect| (about(expect), range(expect.span))).collect();
    let is_old = |about: &About| about.0 == FROM_A_MOMENT && about.1.is_none_or(|named| named == whom);
    let mut places = claims.iter().filter(|(about, _)| !is_old(about));
    let last = places.clone().rfind(|(about, _)| about.1 == Some(whom)).or_else(|| places.next_back());
    let place = &last.or_else(|| claims.last())?.1;
    let line = text[..place.start].rfind('\n').map_or(0, |end| end + 1);
    let indent = &text[line..place.start];
    let indent = if indent.trim().is_empty() { indent } else { "  " };
    // Behind a comment of the same line.
    let rest = text[place.end..].split(['\r', '\n']).next().unwrap_or("");
    let end = if rest.trim_start().starts_with("//") { place.end + rest.len() } else { place.end };
    let old = claims.iter().filter(|(about, _)| is_old(about));
    let mut edits: Vec<(Range<usize>, String)> =
        old.map(|(_, span)| (with_separator(text, span.clone()), String::new())).collect();
    edits.push((end..end, anew.iter().map(|claim| format!("\n{indent}expect {claim}")).collect()));
    Some(edited(text, edits))
}

/// A text in which parts are replaced.
fn edited(text: &str, mut edits: Vec<(Range<usize>, String)>) -> String {
    edits.sort_by_key(|(range, _)| range.start);
    let line_end = if text.contains("\r\n") { "\r\n" } else { "\n" };
    let mut result = String::with_capacity(text.len());
    let mut at = 0;
    for (range, with) in edits {
        // Two fields that go, side by side, may both claim the comma between them.
        result.push_str(&text[at..range.start.max(at)]);
        result.push_str(&with.replace('\n', line_end));
        at = range.end.max(at);
    }
    result + &text[at..]
}

/// Replaces claims that do not hold. The new claim is of the same kind and about the same obstacle, or else about an
/// obstacle for which the file has no claim of that kind. A claim without such a replacement goes.
fn claim_edits(
    (text, old): (&str, &[Expect]),
    (anew, new): (&str, &[Expect]),
    is_refuted: &[bool],
) -> Vec<(Range<usize>, String)> {
    let claimed: Vec<About> = old.iter().map(about).collect();
    let mut left: Vec<(About, &Expect)> = new.iter().map(|expect| (about(expect), expect)).collect();
    // The moments of a finding hold together: a curve without its middle would mislead.
    let is_of_refuted = |about: &About| {
        about.0 == FROM_A_MOMENT && claimed.iter().zip(is_refuted).any(|(other, is)| *is && other == about)
    };
    let goes = |((_, about), is_refuted): &((&Expect, &About), &bool)| **is_refuted || is_of_refuted(about);
    let refuted = old.iter().zip(&claimed).zip(is_refuted).filter(goes);
    let edit = |((expect, known), _): ((&Expect, &About), &bool)| {
        let is_new = |found: &About| found.0 == known.0 && !claimed.contains(found);
        let same = left.iter().position(|(found, _)| found == known);
        match same.or_else(|| left.iter().position(|(found, _)| is_new(found))) {
            Some(at) => (range(expect.span), anew[range(left.remove(at).1.span)].to_owned()),
            None => (with_separator(text, range(expect.span)), String::new()),
        }
    };
    refuted.map(edit).collect()
}

fn about(expect: &Expect) -> About<'_> {
    let has = |kind| expect.clauses.iter().find(|clause| clause.kind == kind);
    let number = has(ClauseKind::With).and_then(|clause| match &clause.value.kind {
        ExprKind::Numbered { number, .. } => Some(number.as_str()),
        _ => None,
    });
    let (kind, whom) = match &expect.claim.kind {
        ExprKind::Name(name) if Avoidability::from_name(name).is_some() => ("avoidable", number),
        ExprKind::Name(name) => (name.as_str(), number),
        ExprKind::Field { .. } => about_requirement(&expect.claim),
        ExprKind::Binary { left, .. } => match &left.kind {
            ExprKind::Name(name) => (name.as_str(), number),
            ExprKind::Field { .. } => about_requirement(left),
            _ => ("", number),
        },
        _ => ("", number),
    };
    let is_timed = kind == RECURRENCE.0 && has(ClauseKind::At).is_some();
    (if is_timed { FROM_A_MOMENT } else { kind }, whom)
}

/// `NAME.breached`: a claim about one requirement is not about another.
fn about_requirement(claim: &ast::Expr) -> About<'_> {
    match &claim.kind {
        ExprKind::Field { base, field } => match &base.kind {
            ExprKind::Name(requirement) => (&field.text, Some(requirement)),
            _ => (&field.text, None),
        },
        _ => ("", None),
    }
}

/// How one field of an origin becomes what it is now.
fn field_edit(
    name: &str,
    (text, old): (&str, &ast::Scenario),
    (anew, new): (&str, &ast::Scenario),
) -> Option<(Range<usize>, String)> {
    let find = |scenario: &ast::Scenario| {
        let field = scenario.origin.iter().find(|field| field.name.text == name);
        field.map(|field| range(field.span))
    };
    match (find(old), find(new)) {
        (Some(old), Some(new)) => {
            (text[old.clone()] != anew[new.clone()]).then(|| (old, anew[new].to_owned()))
        }
        (Some(old), None) => Some((with_separator(text, old), String::new())),
        (None, Some(new)) => {
            let end = old.origin.last()?.span.end;
            Some((end..end, format!("\n    {}", &anew[new])))
        }
        (None, None) => None,
    }
}

/// A field with what parts it from its neighbours: its line, if that has nothing else, or a comma.
fn with_separator(text: &str, field: Range<usize>) -> Range<usize> {
    let before = text[..field.start].trim_end_matches([' ', '\t']);
    let after = text[field.end..].trim_start_matches([' ', '\t', ',']);
    let line_before = before.strip_suffix('\n').map(|before| before.strip_suffix('\r').unwrap_or(before));
    if let Some(before) = line_before
        && (after.is_empty() || after.starts_with(['\r', '\n']))
    {
        return before.len()..text.len() - after.len();
    }
    let is_last = !text[field.end..].trim_start().starts_with(',');
    match before.strip_suffix(',') {
        Some(before) if is_last => before.len()..field.end,
        _ => field.start..text.len() - after.len(),
    }
}

fn range(span: Span) -> Range<usize> {
    span.start..span.end
}

fn parsed(text: &str) -> ast::File {
    avastra_lang::syntax::parse(FileId::default(), text).0
}

fn scenario_of(file: &ast::File) -> Option<(&ast::Scenario, &[Doc])> {
    file.items.iter().find_map(|item| Some((item.kind.as_scenario()?, item.docs.as_slice())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_goes_with_its_line_or_with_its_comma() {
        let without = |text: &str| {
            let start = text.find("ads").expect("it is there");
            let mut text = text.to_owned();
            text.replace_range(with_separator(&text, start..start + "ads: cc".len()), "");
            text
        };
        assert_eq!(without("origin {\n    ads: cc,\n    seed: 1\n}"), "origin {\n    seed: 1\n}");
        assert_eq!(without("origin { ads: cc, seed: 1 }"), "origin { seed: 1 }");
        assert_eq!(without("origin { seed: 1, ads: cc }"), "origin { seed: 1 }");
        assert_eq!(without("origin { a: 1, ads: cc, seed: 1 }"), "origin { a: 1, seed: 1 }");
        assert_eq!(without("a: 1,\r\n  ads: cc,\r\n  b: 2"), "a: 1,\r\n  b: 2");
    }

    const OLD: &str = "\
language 1
/// Sedan npc#1 (DriveAhead) is hit at 3.0 s.
scenario s {
  road: corner
  steps { 0: wait() }
  // who
  expect collision with npc#1 at 3.00 s
  // how
  expect counted with npc#1
  expect avoidable by [cc] with npc#1 // by hand
  expect minimal with npc#1
  expect proc == [0.1]
}
";
    const NEW: &str = "\
language 1
/// SUV npc#2 (Stand) is hit at 4.0 s.
scenario s {
  road: corner
  steps { 0: wait() }
  expect collision with npc#2 at 4.00 s
  expect counted with npc#2
  expect unavoidable with npc#2
  expect priority == ego with npc#2
  expect proc == [
    0.2,
    0.3,
  ]
  expect trace == \"sha256:0\"
}
";

    #[test]
    fn claims_about_another_crash_take_the_place_of_those_about_the_one() {
        let now = rewritten(OLD, NEW, &[true; 5], &[]);
        let (_, claims) = now.split_once("wait() }\n").unwrap();
        let wanted = "  // who
  expect collision with npc#2 at 4.00 s
  // how
  expect counted with npc#2
  expect unavoidable with npc#2 // by hand
  expect proc == [
    0.2,
    0.3,
  ]
}
";
        assert_eq!(claims, wanted);
        // A file keeps its ends of lines.
        let crlf = |text: &str| text.replace('\n', "\r\n");
        assert_eq!(rewritten(&crlf(OLD), NEW, &[true; 5], &[]), crlf(&now));
    }

    #[test]
    fn moments_take_the_place_of_those_that_were_claimed() {
        let claims = |text: &str, whom: &str, anew: &[&str]| {
            let anew: Vec<String> = anew.iter().map(|&claim| claim.to_owned()).collect();
            with_moments(text, whom, &anew)
        };
        let one = "recurrence == 0 / 4 with npc#1 at 1.0 s";
        let other = "recurrence == 1 / 9 with npc#1 at 2.0 s";
        let once = claims(OLD, "1", &[one, other]).unwrap();
        let lines = format!("  expect minimal with npc#1\n  expect {one}\n  expect {other}\n  expect proc");
        assert!(once.contains(&lines), "{once}");
        assert_eq!(claims(&once, "1", &[one, other]).unwrap(), once);
        assert_eq!(claims(&once, "1", &[]).unwrap(), OLD);
        // Behind a comment, and with the file's ends of lines.
        let commented = OLD.replace("  expect minimal with npc#1\n", "");
        let found = claims(&commented.replace('\n', "\r\n"), "1", &[one]).unwrap();
        assert!(found.contains(&format!("// by hand\r\n  expect {one}\r\n  expect proc")), "{found}");
        // A claim without `with` is about the collision, too.
        let unnamed = OLD.replace(" with npc#1", "").replace("minimal", "recurrence == 2 / 4 at 5 s");
        let found = claims(&unnamed, "1", &[one]).unwrap();
        assert!(found.contains(&format!("proc == [0.1]\n  expect {one}\n}}")), "{found}");
        assert!(!found.contains("2 / 4"), "{found}");
        assert_eq!(claims("language 1\nscenario s {\n  road: r\n  steps { }\n}\n", "1", &[one]), None);
    }

    #[test]
    fn if_one_moment_does_not_hold_all_of_its_finding_go() {
        let moments = ["0 / 4 with npc#1 at 1 s", "4 / 4 with npc#1 at 2 s", "4 / 4 with npc#2 at 2 s"];
        let moments = moments.map(|moment| format!("  expect recurrence == {moment}\n"));
        let old = OLD.replace("  expect minimal with npc#1\n", &moments.concat());
        let is_refuted = [false, false, false, true, false, false, false];
        let now = rewritten(&old, OLD, &is_refuted, &[]);
        assert_eq!(now, OLD.replace("  expect minimal with npc#1\n", &moments[2]));
    }
}
