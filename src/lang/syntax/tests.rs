//! Hostile inputs and round trips: the parser always ends with a message, and the printer loses nothing.
//! `tests/cases/diagnostics` tests the message for each mistake, `tests/cases/format` the layout.

use proptest::prelude::*;

use crate::syntax::ast::{
    Arg, Arm, BinaryOp, Call, Case, Comparison, Expr, ExprKind, Field, File, FileId, Item, ItemKind, Let,
    Name, Number, Odds, Require, Scenario, Span, Step, Text, UnaryOp, Use, Verdict,
};
use crate::syntax::{DEPTH_MAX, OPERATORS_MAX, Sources, Style, format, parse, print, render, same_meaning};

const AVASTRA: &str = include_str!("../../../scenarios/avastra45.ava");
const DEEP_COLLISION: &str = include_str!("../../../scenarios/deepcollision52.ava");
const ROADS: &str = include_str!("../../../scenarios/roads.ava");

const EMITTED: &str = r#"//! Emitted by `avastra run`; replay with `avastra replay FILE`.
language 1
use "../avastra45.ava" digest "sha256:9c1f04d2"

/// BoxTruck cuts in from the left at night, in heavy rain, 20.6 m ahead.
scenario corner_0007 {
  origin { seed: 7, episode: 412, policy: "corner_v3", ads: "modular", engine: "plane/1" }
  road: corner
  start { time: Noon, sky: { Rain: High, Fog: None } }
  steps {
    0: set_time(to: Night)
    1: rain(how: High) // wets the road
    2: drive_ahead(lane: Left, mode: Near, then: Change) with {
      vehicle: BoxTruck
      colour: Red
      speed: 11.25 m/s
      distance: 20.625 m
    }
  }
  expect collision with npc#2 at 14.22 s
  expect avoidable by [cc, fsm]
  expect cause == perception
  expect proc == [0.0, 0.12, 1.0]
  expect minimal
  expect trace == "sha256:77aa"
}

policy corner_v3 {
  origin { seed: 3, episodes: 750, roads: [corner], kept: 612, agent: "ddqn" }
  net { inputs: features_v1, layers: [26, 256, 256, 45], weights: "corner_v3.f32" }
  claims { fidelity: 0.913, regret: 0.021, return: 0.97, states: 20000 }
  rules {
    when dist_nearest <= 14.5 m and time == Night => drive_ahead(Left, Near, Change) // 3120 states
    when ego_speed > 8.25 m/s and sky[Rain] < High => rain(High)
    _ => pedestrian(Right)
  }
}
"#;

fn tree(text: &str) -> File {
    let (tree, found) = parse(FileId(0), text);
    assert!(found.is_empty(), "{}", rendered(text));
    tree
}

fn rendered(text: &str) -> String {
    let mut sources = Sources::new();
    let file = sources.add("a.ava", text);
    let (_, found) = parse(file, text);
    let drawn = found.iter().map(|diagnostic| render(diagnostic, &sources, Style::Plain));
    drawn.collect::<Vec<_>>().join("\n\n")
}

/// The codes of the mistakes in a text with its lines, for example `AV0001:2`.
fn codes(text: &str) -> Vec<String> {
    let mut sources = Sources::new();
    let file = sources.add("a.ava", text);
    let (_, found) = parse(file, text);
    let code = |place: Option<Span>| place.map_or(0, |place| sources.line_column(file, place.start).0);
    found.iter().map(|diagnostic| format!("{}:{}", diagnostic.code, code(diagnostic.place()))).collect()
}

#[test]
fn our_own_files_are_sound_and_formatted() {
    for text in [AVASTRA, DEEP_COLLISION, ROADS, EMITTED] {
        assert_eq!(rendered(text), "");
        assert_eq!(format(FileId(0), text).unwrap(), text);
        assert!(same_meaning(&tree(&print(&tree(text))), &tree(text)));
    }
}

#[test]
fn depth_is_bounded_alike_everywhere() {
    let nested = |depth: usize| format!("language 1\nlet x = {}1{}\n", "(".repeat(depth), ")".repeat(depth));
    assert!(codes(&nested(DEPTH_MAX)).is_empty());
    assert_eq!(codes(&nested(DEPTH_MAX + 1)), ["AV0003:2"]);
    for text in [
        nested(100_000),
        format!("language 1\nlet x = {}1\n", "- ".repeat(100_000)),
        format!("language 1\nlet x = {}1\n", "not ".repeat(100_000)),
        format!("language 1\nlet x = 1{}\n", " + 1".repeat(100_000)),
        format!("language 1\nlet x = 1{}\n", " implies 1".repeat(100_000)),
        format!("language 1\nlet x = a{}\n", ".a".repeat(100_000)),
        format!("language 1\nlet x = a{}\n", "[a]".repeat(100_000)),
    ] {
        assert_eq!(codes(&text), ["AV0003:2"]);
    }
    let sum = |terms: usize| format!("language 1\nlet x = 1{}\n", " + 1".repeat(terms));
    assert!(codes(&sum(OPERATORS_MAX)).is_empty());
    assert_eq!(codes(&sum(OPERATORS_MAX + 1)), ["AV0003:2"]);
    let opened = format!("language 1\nlet x = {}", "f([{a: ".repeat(100_000));
    assert_eq!(codes(&opened), ["AV0003:2"]);
    let unfinished = format!("language 1\nlet x = {}", "f({a: -(".repeat(21));
    assert_eq!(codes(&unfinished), ["AV0004:2"]);
    // The deepest that is allowed, with everything in it, must fit the stack of a thread.
    let mixed = format!("language 1\nlet x = {}1{}\n", "f({a: -(".repeat(21), ")})".repeat(21));
    assert!(codes(&mixed).is_empty());
    assert!(format(FileId(0), &mixed).is_ok());
}

/// The subject of a `match` needs no bracket.
#[test]
fn the_depth_of_matches_is_bounded() {
    let matches = |depth: usize| {
        let arms = " { true => false, false => true }".repeat(depth);
        format!("language 1\nfn f(x: Bool) -> Bool = {}x{arms}\n", "match ".repeat(depth))
    };
    assert!(codes(&matches(DEPTH_MAX)).is_empty());
    for depth in [DEPTH_MAX + 1, 10_000] {
        assert_eq!(codes(&matches(depth)), ["AV0003:2"]);
    }
    // One after the other, or in an arm, is not one in the subject of another.
    let apart = "let a = match true { true => 1, false => 2 }\n".repeat(2 * DEPTH_MAX);
    assert!(codes(&format!("language 1\n{apart}")).is_empty());
    // A `{` that begins a record does not belong to a `match`.
    let records = format!("language 1\nlet a = {}1\n", "match {} + ".repeat(10_000));
    assert_eq!(codes(&records), ["AV0003:2"]);
}

#[test]
fn long_lines_and_many_mistakes_are_no_trouble() {
    let long = format!("language 1\nlet x = \"{}\"\n", "x".repeat(1 << 20));
    assert!(codes(&long).is_empty());
    // Two megabytes on one line are read, refused with one short message, and shown.
    let endless = format!("language 1\nlet x = \"{}\n", "x".repeat(1 << 21));
    assert_eq!(codes(&endless), ["AV0009:2"]);
    assert!(rendered(&endless).len() < 10_000);
    let wrong = format!("language 1\nlet x = {}\n", "x ".repeat(1 << 18));
    assert_eq!(codes(&wrong), ["AV0001:2"]);
    assert!(!rendered(&wrong).is_empty());
    let odd = format!("language 1\n{}", "let ( = } \u{e9}\nlet x = (\n".repeat(20_000));
    assert_eq!(codes(&odd).len(), 100);
    let many = format!("language 1\n{}", "lett x = 1\n".repeat(20_000));
    assert_eq!(codes(&many).len(), 100);
}

/// A cut file is cut in its last declaration, so each declaration of a long file is cut alone.
#[test]
fn every_prefix_of_a_file_is_read_to_its_end() {
    let few = |text: &str| {
        let (_, found) = parse(FileId(0), text);
        assert!(found.len() <= 2, "{}", rendered(text));
    };
    for (end, _) in EMITTED.char_indices() {
        few(&EMITTED[..end]);
    }
    for item in tree(AVASTRA).items {
        let declaration = &AVASTRA[item.span.start..item.span.end];
        for (end, _) in declaration.char_indices() {
            few(&format!("language 1\n{}", &declaration[..end]));
        }
    }
}

#[test]
fn foreign_line_ends_are_unified() {
    let text = "//! a\r\nlanguage 1\r\n/// b\r\nlet x = 1 // c\r\n";
    assert_eq!(format(FileId(0), text).unwrap(), text.replace('\r', ""));
}

fn name() -> impl Strategy<Value = Name> {
    prop_oneof![
        "[a-zA-Z][a-z_0-9]{0,6}",
        Just("lane".to_owned()),
        Just("road".to_owned()),
        Just("at".to_owned()),
        Just("set".to_owned())
    ]
    .prop_filter("not a reserved word", |word| {
        let text = format!("language 1\nlet {word} = {word}\n");
        parse(FileId(0), &text).1.is_empty()
    })
    .prop_map(Name::built)
}

fn number() -> impl Strategy<Value = Number> {
    let unit =
        prop_oneof![Just(None), Just(Some("m")), Just(Some("m/s^2")), Just(Some("%")), Just(Some("e3"))];
    ("[0-9]{1,3}(\\.[0-9]{1,3})?(e-[0-9])?", unit).prop_map(|(digits, unit)| Number {
        digits,
        unit: unit.map(Name::built),
        span: Span::NONE,
    })
}

fn expr() -> impl Strategy<Value = Expr> {
    let leaf = prop_oneof![
        number().prop_map(ExprKind::Number),
        name().prop_map(|name| ExprKind::Name(name.text)),
        any::<bool>().prop_map(ExprKind::Bool),
        "\\PC{0,5}[\"\\\\\n\t]?".prop_map(ExprKind::Text),
        (name(), 0..9u8).prop_map(|(name, number)| ExprKind::Numbered { name, number: number.to_string() }),
        ("[0-9a-z]{0,3}", -3..3i8, number()).prop_map(|(road, lane, station)| ExprKind::LanePoint {
            road: Text::new(road, Span::NONE),
            lane: Name::built(lane.to_string()),
            station,
        }),
    ];
    leaf.prop_map(Expr::built).prop_recursive(4, 24, 3, |inner| {
        let boxed = || inner.clone().prop_map(Box::new);
        let arg = (proptest::option::of(name()), inner.clone()).prop_map(|(name, value)| Arg { name, value });
        prop_oneof![
            (any::<bool>(), boxed()).prop_map(|(not, operand)| ExprKind::Unary {
                op: if not { UnaryOp::Not } else { UnaryOp::Negate },
                operand
            }),
            (prop::sample::select(&BinaryOp::ALL[..]), boxed(), boxed())
                .prop_map(|(op, left, right)| { ExprKind::Binary { op, op_span: Span::NONE, left, right } }),
            (boxed(), boxed()).prop_map(|(low, high)| ExprKind::Range { low, high }),
            (boxed(), name()).prop_map(|(base, field)| ExprKind::Field { base, field }),
            (boxed(), boxed()).prop_map(|(base, index)| ExprKind::Index { base, index }),
            prop::collection::vec(inner.clone(), 0..3).prop_map(ExprKind::List),
            entries(inner.clone()).prop_map(ExprKind::Record),
            (name(), prop::collection::vec(arg, 0..3)).prop_map(|(name, args)| ExprKind::Call(Call {
                name,
                args,
                span: Span::NONE
            })),
            (boxed(), arms(inner.clone())).prop_map(|(subject, arms)| ExprKind::Match { subject, arms }),
        ]
        .prop_map(Expr::built)
    })
}

fn entries(value: impl Strategy<Value = Expr>) -> impl Strategy<Value = Vec<Field>> {
    let entry = (name(), value).prop_map(|(name, value)| Field { name, value, span: Span::NONE });
    prop::collection::vec(entry, 0..3)
}

fn arms(value: impl Strategy<Value = Expr>) -> impl Strategy<Value = Vec<Arm>> {
    let patterns = prop::collection::vec(name(), 0..3);
    let arm = (patterns, value).prop_map(|(patterns, value)| Arm { patterns, value, span: Span::NONE });
    prop::collection::vec(arm, 0..3)
}

fn item() -> impl Strategy<Value = ItemKind> {
    let case = (proptest::option::of(expr()), expr()).prop_map(|(condition, value)| Case {
        condition,
        value,
        span: Span::NONE,
    });
    let entries = || entries(expr());
    let when = || {
        let maybe = || prop::option::of(expr());
        (maybe(), maybe(), maybe()).prop_map(|(once, held, after)| {
            let held = held.filter(|_| once.is_some());
            (once, held, after)
        })
    };
    let scenario = (name(), name(), entries(), entries(), entries(), when()).prop_map(
        |(name, road, origin, start, drawn, (once, held, after))| {
            let args =
                start.iter().map(|entry| Arg { name: Some(entry.name.clone()), value: entry.value.clone() });
            let action = Call { name: name.clone(), args: args.collect(), span: Span::NONE };
            let number = Number { digits: "0".to_owned(), unit: None, span: Span::NONE };
            let steps = vec![Step { number, action, drawn, once, held, after, span: Span::NONE }];
            ItemKind::Scenario(Scenario { name, origin, road, start, steps, expects: Vec::new() })
        },
    );
    let asked = (name(), name()).prop_map(|(left, right)| {
        let named = |name: Name| Box::new(Expr::built(ExprKind::Name(name.text)));
        let op = BinaryOp::Compare(Comparison::Equal);
        Expr::built(ExprKind::Binary { op, op_span: Span::NONE, left: named(left), right: named(right) })
    });
    prop_oneof![
        (name(), expr()).prop_map(|(name, value)| ItemKind::Let(Let { name, value })),
        (name(), expr())
            .prop_map(|(name, value)| { ItemKind::Override(Box::new(ItemKind::Let(Let { name, value }))) }),
        (name(), expr()).prop_map(|(name, condition)| ItemKind::Verdict(Verdict { name, condition })),
        // A word that is no unit, after a number and before the colon of a condition, would be the name of a field.
        (
            (any::<bool>(), name(), prop::collection::vec(name(), 0..3)),
            prop::array::uniform3(proptest::option::of(asked)),
            expr(),
            prop::array::uniform2(proptest::option::of(expr()))
        )
            .prop_map(|((optional, name, on), [when, until, after], condition, [unless, within])| {
                let until = until.filter(|_| when.is_some());
                let required = Require { optional, name, on, when, until, after, condition, unless, within };
                ItemKind::Require(Box::new(required))
            }),
        prop::collection::vec(case, 0..4).prop_map(ItemKind::Reward),
        (name(), arms(expr())).prop_map(|(name, arms)| ItemKind::Odds(Odds { name, arms })),
        ("\\PC{0,5}", proptest::option::of("[a-f0-9]{0,4}"), prop::collection::vec(name(), 0..3)).prop_map(
            |(path, digest, without)| {
                let text = |value: String| Text::new(value, Span::NONE);
                ItemKind::Use(Use { path: text(path), digest: digest.map(text), without })
            }
        ),
        entries().prop_map(ItemKind::Episode),
        scenario,
    ]
}

/// The grammar spells the units once more, to know them before a colon.
#[test]
fn every_unit_may_stand_before_a_colon() {
    for unit in avastra_base::units::UNITS {
        let text = format!("language 1\nrequire r when a >= 1 {}: b < 2\n", unit.word);
        let (file, diagnostics) = parse(FileId::default(), &text);
        assert!(diagnostics.is_empty(), "{}: {diagnostics:?}", unit.word);
        let when = file.items[1].kind.as_require().and_then(|required| required.when.as_ref());
        assert!(format!("{when:?}").contains(&format!("{:?}", unit.word)), "{}: {when:?}", unit.word);
    }
}

fn file_of(kinds: Vec<ItemKind>) -> File {
    let version = Number { digits: "1".to_owned(), unit: None, span: Span::NONE };
    let kinds = std::iter::once(ItemKind::Language(version)).chain(kinds);
    let items = kinds.map(|kind| Item { docs: Vec::new(), kind, span: Span::NONE }).collect();
    File { items, ..File::default() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(192))]

    #[test]
    fn what_is_printed_reads_back(kinds in prop::collection::vec(item(), 0..4)) {
        let built = file_of(kinds);
        let text = print(&built);
        let (read, found) = parse(FileId(0), &text);
        prop_assert!(found.is_empty(), "{}\n{}", text, rendered(&text));
        prop_assert!(same_meaning(&built, &read), "{}", text);
        let formatted = format(FileId(0), &text).unwrap();
        prop_assert_eq!(format(FileId(0), &formatted).unwrap(), formatted);
    }

    /// A line of comment before every line of a generated program.
    #[test]
    fn comments_in_generated_programs_are_kept(kinds in prop::collection::vec(item(), 1..4)) {
        let text = print(&file_of(kinds));
        let commented: Vec<String> =
            text.lines().enumerate().map(|(number, line)| format!("// note {number}.\n{line}\n")).collect();
        // Inside a text a line break cannot stand, so every line begins outside of one.
        let formatted = format(FileId(0), &commented.concat()).unwrap();
        for number in 0..commented.len() {
            prop_assert_eq!(formatted.matches(&format!("// note {number}.\n")).count(), 1, "{}", formatted);
        }
        prop_assert_eq!(format(FileId(0), &formatted).unwrap(), formatted);
    }

    /// A comment wherever a blank is, however odd the place.
    #[test]
    fn comments_survive_anywhere(places in prop::collection::vec(0..4000usize, 1..6), which in 0..2usize) {
        let text = [AVASTRA, EMITTED][which];
        let (mut text, mut meaning) = (text.to_owned(), tree(text));
        for (count, place) in places.into_iter().enumerate() {
            let blanks: Vec<usize> = text.match_indices([' ', '\n']).map(|(at, _)| at).collect();
            let at = blanks[place % blanks.len()];
            let mut changed = text.clone();
            changed.insert_str(at, &format!(" // note {count}\n"));
            // Inside a text, a documentation line or between a number and its unit it says something else.
            let (tree, found) = parse(FileId(0), &changed);
            if found.is_empty() && same_meaning(&tree, &meaning) {
                (text, meaning) = (changed, tree);
            }
        }
        let once = format(FileId(0), &text).unwrap();
        prop_assert_eq!(format(FileId(0), &once).unwrap(), once);
    }
}
