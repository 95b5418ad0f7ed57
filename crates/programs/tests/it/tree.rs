//! Parsing never fails and loses nothing.

use proptest::prelude::*;
use truegrind_programs::motion::OpaqueReason;
use truegrind_programs::rapid::lexer::{self, lex};
use truegrind_programs::rapid::parser::parse;
use truegrind_programs::rapid::token::keyword;

mod nodes;
mod starts;

pub(crate) const PROGRAM: &str = r#"%%%
  VERSION:1
  LANGUAGE:ENGLISH
%%%
MODULE Sample(SYSMODULE, NOSTEPIN)
  ! types
  RECORD part
    robtarget place;
    num width;
  ENDRECORD
  LOCAL ALIAS num millimetre;
  CONST robtarget p10:=[[500,-100.5,3E2],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  LOCAL VAR num a{2,3}:=[[1,2,3],[4,5,- 6]];
  TASK PERS tooldata t:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PROC main()
    VAR num i;
    FOR i FROM 1 TO 3 DO
      IF a{1,i}>2 AND NOT done OR i=3 THEN
        MoveL Offs(p10,i*10,0,0)\ID:=3,v100,z10,t\WObj:=wobj0; MoveJ \Conc, p10, v100, fine, t;
      ELSEIF x THEN
        TEST i
        CASE 1,2: GOTO l1;
        DEFAULT: %"proc"+NumToStr(i,0)% p10\sw, 3;
        ENDTEST
      ELSE
        IF a{1,1}>3 p.trans.x:=.5; <SMT>
      ENDIF
    ENDFOR
  l1:
    WHILE TRUE DO ENDWHILE
    TPWrite "a ! "" \0A ; \\";
    CONNECT intno WITH trap1;
    RETURN;
  BACKWARD
    RETURN;
  ERROR (ERR_X, ERR_Y)
    RETRY;
  UNDO
    EXIT;
  ENDPROC
  LOCAL FUNC num f(num a, \switch b | switch c, INOUT robtarget d{*,*} \ PERS tooldata e)
    RETURN (-a+2)*Abs(d{1,2}.trans.z);
  ENDFUNC
  TRAP trap1
    f 1\b?c, q:=3;
  ENDTRAP
ENDMODULE
"#;

fn check(source: &[u8]) {
    let tree = parse(source);
    assert_eq!(tree.print(), source);
    assert_eq!(tree.nodes.subtree_end(0), tree.nodes.len());
    assert_eq!(tree.nodes.get(0).end as usize, tree.len());
    // Every node lies inside its parent and siblings do not overlap.
    let mut open: Vec<(usize, u32, u32)> = vec![];
    for (index, node) in tree.nodes.iter().enumerate() {
        while open.last().is_some_and(|&(end, ..)| end <= index) {
            open.pop();
        }
        assert!(node.first <= node.end && node.size > 0, "{index} {node:?}");
        if let Some((_, least, most)) = open.last_mut() {
            assert!(node.first >= *least && node.end <= *most, "{index} {node:?} {least} {most}");
            *least = node.end;
        }
        open.push((index + node.size as usize, node.first, node.end));
    }
}

#[test]
fn a_program_of_every_construct_has_no_opaque_region() {
    check(PROGRAM.as_bytes());
    let tree = parse(PROGRAM.as_bytes());
    let told: Vec<_> = tree
        .opaque
        .iter()
        .map(|o| {
            (
                tree.line_column(tree.start(o.at)),
                String::from_utf8_lossy(&PROGRAM.as_bytes()[tree.range(o.first, o.end)]),
            )
        })
        .collect();
    assert!(told.is_empty(), "{told:?}");
}

#[test]
fn unreadable_text_is_opaque_with_a_reason_and_the_rest_is_parsed() {
    let cases: &[(&str, OpaqueReason, (u32, u32), &str)] = &[
        (
            "PROC a()\nMoveL p1 v1;\nMoveL p2,v1;\nENDPROC",
            OpaqueReason::MissingSemicolon,
            (2, 10),
            "MoveL p1 v1;",
        ),
        ("PROC a()\nMoveL p1\nMoveL p2,v1;\nENDPROC", OpaqueReason::MissingSemicolon, (3, 1), "MoveL p1"),
        ("PROC a()\nx:=;\ny:=1;\nENDPROC", OpaqueReason::ExpectedExpression, (2, 4), "x:=;"),
        ("PROC a()\nx:=[1,2;\ny:=1;\nENDPROC", OpaqueReason::Unclosed, (2, 8), "x:=[1,2;"),
        ("PROC a()\nTPWrite \"abc;\ny:=1;\nENDPROC", OpaqueReason::UnclosedString, (2, 9), "TPWrite \"abc;"),
        ("PROC a()\nENDIF\ny:=1;\nENDPROC", OpaqueReason::StrayEnd, (2, 1), "ENDIF"),
        ("PROC a()\nIF x THEN\ny:=1;\nENDPROC", OpaqueReason::MissingEnd, (4, 1), "IF"),
        ("PROC a()\n@@ x\ny:=1;\nENDPROC", OpaqueReason::Unexpected, (2, 1), "@@ x"),
        ("VAR num;", OpaqueReason::ExpectedName, (1, 8), "VAR num;"),
        ("\u{1}\u{2}\u{0}\u{3}\u{4}", OpaqueReason::Binary, (1, 1), "\u{1}\u{2}\u{0}\u{3}\u{4}"),
    ];
    for (source, reason, place, text) in cases {
        check(source.as_bytes());
        let tree = parse(source.as_bytes());
        assert_eq!(tree.opaque.len(), 1, "{source}: {:?}", tree.opaque);
        let opaque = tree.opaque[0];
        let found = &source[tree.range(opaque.first, opaque.end)];
        assert_eq!((opaque.reason, found), (*reason, *text), "{source}");
        assert_eq!(tree.line_column(tree.start(opaque.at)), *place, "{source}");
    }
}

#[test]
fn deep_nesting_ends_in_an_opaque_region_and_not_in_the_stack() {
    for (open, close) in [("[", "]"), ("(", ")"), ("f(", ")"), ("-", ""), ("NOT ", ""), ("a{", "}")] {
        let source =
            format!("PROC a()\nx:={}1{};\ny:=2;\nENDPROC", open.repeat(100_000), close.repeat(100_000));
        check(source.as_bytes());
        let tree = parse(source.as_bytes());
        assert!(tree.opaque.iter().any(|o| o.reason == OpaqueReason::TooDeep), "{open}");
    }
    let source = format!("PROC a()\n{}ENDPROC\nPROC b()\nENDPROC", "IF a THEN\n".repeat(100_000));
    check(source.as_bytes());
    assert!(parse(source.as_bytes()).opaque.iter().any(|o| o.reason == OpaqueReason::TooDeep));
    let chain = format!("PROC a()\nx:=1{};\nENDPROC", "+1".repeat(100_000));
    check(chain.as_bytes());
    assert!(parse(chain.as_bytes()).opaque.is_empty());
}

proptest! {
    #[test]
    fn any_bytes_come_back(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        check(&bytes);
    }

    #[test]
    fn any_order_of_tokens_comes_back(words in proptest::collection::vec(0_usize..60, 0..80)) {
        let pieces = ["MODULE", "ENDMODULE", "PROC", "ENDPROC", "FUNC", "ENDFUNC", "IF", "THEN", "ELSE", "ELSEIF", "ENDIF",
            "FOR", "FROM", "TO", "DO", "ENDFOR", "WHILE", "ENDWHILE", "TEST", "CASE", "DEFAULT", "ENDTEST", "ERROR", "UNDO",
            "VAR", "CONST", "LOCAL", "RECORD", "ENDRECORD", "num", "x", "y", "1", ".5E3", "\"s\"", "\"s\n", "[", "]", "(", ")",
            "{", "}", ",", ";", ":=", ":", ".", "+", "-", "*", "NOT", "AND", "\\", "?", "%", "<SMT>", "! c\n", "\n", "%%%", "|"];
        let text: String = words.iter().map(|&word| format!("{} ", pieces[word])).collect();
        check(text.as_bytes());
    }

    #[test]
    fn a_damaged_program_comes_back(at in 0_usize..PROGRAM.len(), cut in 0_usize..40, insert in proptest::collection::vec(any::<u8>(), 0..6)) {
        let mut bytes = PROGRAM.as_bytes().to_vec();
        bytes.splice(at..(at + cut).min(PROGRAM.len()), insert);
        check(&bytes);
    }
}

#[test]
fn a_large_file_is_split_into_the_same_tokens_on_any_number_of_threads() {
    // Constructs across line ends, or that look like it: white space, headers, open strings, comments, other
    // encodings.
    let lines: [&[u8]; 9] = [
        b"%%%\n  VERSION:1\n  LANGUAGE:ENGLISH\n%%%\n",
        b"  MoveL [[1.5,-2,3E-2],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z1,tool0;\r\n",
        b"\n\t \x0c \xa0  \n",
        b"TPWrite \"open ; ! string\n",
        b"! comment \"%%%\n",
        b"\xcc\xe1\xb9\xa9:=\"\xb0\x5c\";\n\xa0x:=1;\r",
        b"%\"proc\"+name% 1,2;  <SMT>\n",
        b"a:=b%%%c;\n",
        b"IF a<=b THEN c:=0x1F; ENDIF",
    ];
    let mut source = Vec::new();
    let mut state = 7_u32;
    while source.len() < (3 << 20) {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        source.extend_from_slice(lines[(state >> 24) as usize % lines.len()]);
    }
    let told = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let tree = pool.install(|| lex(&source));
        let starts: Vec<usize> = (0..tree.len() as u32).map(|token| tree.start(token)).collect();
        let places: Vec<(u32, u32)> = starts.iter().step_by(101).map(|&at| tree.line_column(at)).collect();
        (tree.kinds().to_vec(), starts, places)
    };
    let one = told(1);
    assert!(one.0.len() > 100_000);
    for threads in [2, 3, 8] {
        assert!(told(threads) == one, "{threads} threads");
    }
}

#[test]
fn a_place_is_found_from_any_other_line() {
    let source = b"MODULE M\n\n\n  PROC p()\n    ! a\n    p;\n\n\n\n\n\n    p;\n  ENDPROC\nENDMODULE";
    let tree = lex(source);
    for byte in 0..=source.len() {
        for last in 0..20 {
            assert_eq!(
                tree.line_column_after(byte, last),
                tree.line_column(byte),
                "byte {byte} from line {last}"
            );
        }
    }
}

/// Sixteen bytes are looked at at once: a number must end as in a byte-by-byte reader, whatever its length, the next
/// byte, and the end of the text.
#[test]
fn a_number_ends_at_its_last_digit_whatever_follows() {
    for length in 1..20 {
        let digits: Vec<u8> = (0..length).map(|k| b'0' + (7 * k + 1) as u8 % 10).collect();
        assert_eq!(lexer::number(&digits).unwrap().1, digits);
        for after in 0..=255_u8 {
            if after.is_ascii_digit() || matches!(after, b'.' | b'e' | b'E') {
                continue;
            }
            for tail in [&b""[..], b"1", b"123456789"] {
                let text = [&digits[..], &[after], tail].concat();
                let (rest, number) = lexer::number(&text).unwrap();
                assert_eq!((number, rest), (&digits[..], &text[length..]), "{length} digits before {after}");
            }
        }
        let text = [&digits[..], b".", &digits, b"E-", &digits, b","].concat();
        assert_eq!(lexer::number(&text).unwrap().0, b",");
    }
}

/// As above, for whatever may stand in a number, and wherever the sixteen bytes end.
#[test]
fn a_number_is_what_a_byte_by_byte_reader_finds() {
    fn digits(text: &[u8], at: usize) -> usize {
        at + text[at..].iter().take_while(|byte| byte.is_ascii_digit()).count()
    }
    fn plainly(text: &[u8]) -> usize {
        let whole = digits(text, 0);
        let point = text.get(whole) == Some(&b'.');
        let end = if point { digits(text, whole + 1) } else { whole };
        if end == usize::from(point) {
            return 0;
        }
        if !matches!(text.get(end), Some(b'e' | b'E')) {
            return end;
        }
        let from = end + 1 + usize::from(matches!(text.get(end + 1), Some(b'+' | b'-')));
        if text.get(from).is_some_and(u8::is_ascii_digit) { digits(text, from) } else { end }
    }
    let mut state = 11_u32;
    let mut random = |below: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 16) % below
    };
    for _ in 0..200_000 {
        let rare = 2 + random(20);
        let text: Vec<u8> =
            (0..random(40))
                .map(|_| {
                    if random(rare) > 0 {
                        b'1' + random(9) as u8
                    } else {
                        b"0..eE+-,] x"[random(11) as usize]
                    }
                })
                .collect();
        // A leading zero may begin a number of another base.
        if text.starts_with(b"0x") {
            continue;
        }
        let found = lexer::number(&text).map_or(0, |(rest, _)| text.len() - rest.len());
        assert_eq!(found, plainly(&text), "{}", String::from_utf8_lossy(&text));
    }
}

/// A name is a reserved word only by exactly its letters, in any case.
#[test]
fn reserved_words_are_told_from_names_that_are_nearly_theirs() {
    let words = [
        "ENDMODULE",
        "SYSMODULE",
        "TO",
        "If",
        "movel",
        "VIEWONLY",
        "v100",
        "TryNext",
        "xor",
        "ALIAS",
        "with",
    ];
    let reserved = |text: &[u8]| keyword(text).is_some();
    for word in words {
        let known = !matches!(word, "movel" | "v100");
        assert_eq!(reserved(word.as_bytes()), known, "{word}");
        assert_eq!(reserved(word.to_lowercase().as_bytes()), known, "{word}");
        let longer = format!("{word}_");
        assert!(!reserved(longer.as_bytes()) && !reserved(&[&[0xDC], word.as_bytes()].concat()), "{word}");
    }
    assert!(!reserved(b"") && !reserved(b"ENDMODUL") && !reserved(b"@ND") && !reserved(b"_R"));
}
