use truegrind_math::difference;
use truegrind_surfaces::expression::{Expression, FUNCTIONS, MAX_CHARACTERS, MAX_DEPTH};

fn value(text: &str, at: [f64; 3]) -> f64 {
    Expression::parse(text, &["x", "y", "z"]).unwrap().value(&at)
}

#[test]
fn binds_as_mathematics_does() {
    let at = [-2.0, 3.0, 0.5];
    let cases = [
        ("-x^2", -4.0),
        ("-x**2", -4.0),
        ("2^3^2", 512.0),
        ("2^-1", 0.5),
        ("x^-2", 0.25),
        ("-2^2", -4.0),
        ("(-2)^2", 4.0),
        ("1 - 2 - 3", -4.0),
        ("12/2/3", 2.0),
        ("12/2*3", 18.0),
        ("2*x - -y", -1.0),
        ("- - x", -2.0),
        ("+x", -2.0),
        ("1e-3*y + 2.5E2", 250.003),
        ("1.e1", 10.0),
        (".5*y", 1.5),
        ("2*e", 2.0 * std::f64::consts::E),
        ("cos(pi) + sin(π/2) + tau", std::f64::consts::TAU),
        ("abs(x) + abs(-3)", 5.0),
        ("sqrt(y + 1)*ln(e)", 2.0),
        ("log10(1000)", 3.0),
        ("((((x))))", -2.0),
        ("x*y/z", -12.0),
        ("x-y-z", -5.5),
        ("1/1e-7", 1e7),
    ];
    for (text, expected) in cases {
        let found = value(text, at);
        assert!((found - expected).abs() < 1e-12 * (1.0 + expected.abs()), "{text}: {found}, not {expected}");
    }
}

#[test]
fn derivatives_have_a_numerical_twin() {
    let mut texts: Vec<String> =
        FUNCTIONS.iter().map(|f| format!("{}(0.3 + 0.2*x - 0.1*y*z) * (1 + x*y)", f.0)).collect();
    texts.extend(
        [
            "-x^2/300 + y^3/7 - z^-2",
            "x^2*y^2*z^2",
            "(x - y)^3/(1 + z^2)",
            "x^0.5 + z^x",
            "exp(-(x^2 + y^2)/4)*sin(x*y*z)",
            "x/y/z - z/(x + y)",
            "7",
            "y",
        ]
        .map(str::to_owned),
    );
    let at = [0.7, -0.4, 1.3];
    for text in texts {
        let expression = Expression::parse(&text, &["x", "y", "z"]).unwrap();
        let steps = [1e-3; 3];
        let first = difference::jacobian(|p, out| out[0] = expression.value(p), &at, 1, &steps);
        let gradient = expression.gradient(&at);
        let second = difference::jacobian(
            |p, out| out.copy_from_slice(expression.gradient(p).as_slice()),
            &at,
            3,
            &steps,
        );
        let hessian = expression.hessian(&at);
        for i in 0..3 {
            assert!((gradient[i] - first[(0, i)]).abs() < 1e-8, "{text}, d/d{i}: {gradient} {first}");
            for k in 0..3 {
                assert!(
                    (hessian[(i, k)] - second[(i, k)]).abs() < 1e-7,
                    "{text}, d²/d{i}d{k}: {hessian} {second}"
                );
            }
        }
    }
}

#[test]
fn powers_have_derivatives_at_and_below_zero() {
    let cubic = Expression::parse("x^3 + y^2", &["x", "y"]).unwrap();
    assert_eq!(cubic.gradient(&[0.0, 0.0]).as_slice(), [0.0, 0.0, 0.0]);
    assert_eq!(cubic.gradient(&[-2.0, -3.0]).as_slice(), [12.0, -6.0, 0.0]);
    assert_eq!(cubic.hessian(&[-2.0, 0.0])[(0, 0)], -12.0);
}

#[test]
fn a_vanishing_derivative_stays_zero_where_a_function_is_infinitely_steep() {
    let root = Expression::parse("sqrt(x) + y^2", &["x", "y"]).unwrap();
    assert_eq!(root.gradient(&[0.0, 3.0]).as_slice(), [f64::INFINITY, 6.0, 0.0]);
    let kink = Expression::parse("abs(x) + y", &["x", "y"]).unwrap();
    assert_eq!(kink.gradient(&[-2.0, 3.0]).as_slice(), [-1.0, 1.0, 0.0]);
    assert!(kink.gradient(&[0.0, 3.0])[0].is_nan());
}

#[test]
fn only_the_variables_that_occur_are_used_and_in_their_order() {
    let expression = Expression::parse("v - 2*u", &["u", "v"]).unwrap();
    assert_eq!(expression.value(&[3.0, 10.0]), 4.0);
    let expression = Expression::parse("z^2 + 5", &["x", "y", "z"]).unwrap();
    assert_eq!(expression.value(&[f64::NAN, f64::NAN, 3.0]), 14.0);
    assert_eq!(expression.gradient(&[0.0, 0.0, 3.0]).as_slice(), [0.0, 0.0, 6.0]);
}

#[test]
fn what_cannot_be_read_says_where_and_why() {
    // Text, column, a part of what was found, a part of what was expected.
    let cases = [
        ("", 1, "the end of the text", "a number, a variable"),
        ("   ", 4, "the end of the text", "a number, a variable"),
        ("12 - x^^2", 8, "`^`", "a number"),
        ("x +", 4, "the end", "a number"),
        ("2x", 2, "`x`", "`2*x`"),
        ("2 3", 3, "the number 3", "operator"),
        ("(x + 1", 7, "the end", "`)` for the `(` at column 1"),
        ("x + 1)", 6, "`)`", "opening parenthesis"),
        ("x(3)", 2, "`(`", "operator"),
        ("sin x", 5, "`x`", "`(` after the function `sin`"),
        ("sinus(x)", 1, "`sinus`", "variables x, y"),
        ("z + x", 1, "`z`", "variables x, y"),
        ("x + log(y)", 5, "`log`", "`ln` or `log10`"),
        ("1,5*x", 2, "`,`", "decimal point"),
        ("z = x", 1, "`z`", "variables"),
        ("x = 3", 3, "`=`", "right-hand side"),
        ("1.2.3", 1, "`1.2.3`", "a number"),
        (".", 1, "`.`", "a number"),
        ("1e999", 1, "`1e999`", "a number"),
        ("x + 1/0", 6, "inf", "finite"),
        ("sqrt(-1) + x", 1, "NaN", "finite"),
        ("ln(0)", 1, "-inf", "finite"),
        ("x % 2", 3, "`%`", "one of + - * / ^"),
        ("α + x", 1, "`α`", "variables"),
        ("x + {y}", 5, "`{`", "a parenthesis"),
        ("*x", 1, "`*`", "a number"),
        ("x */ y", 4, "`/`", "a number"),
        ("()", 2, "`)`", "a number"),
        ("sin()", 5, "`)`", "a number"),
    ];
    for (text, column, found, expected) in cases {
        let error = Expression::parse(text, &["x", "y"]).unwrap_err();
        let message = error.to_string();
        assert_eq!(error.column, column, "{message}");
        assert!(error.found.contains(found), "{message}");
        assert!(error.expected.contains(expected), "{message}");
        assert!(message.contains(text) && message.contains(&format!("column {column}")), "{message}");
    }
}

#[test]
fn many_terms_are_differentiated_not_overflown() {
    let many = Expression::parse(&format!("{}x", "x+".repeat(149)), &["x", "y"]).unwrap();
    assert_eq!((many.value(&[2.0, 0.0]), many.gradient(&[2.0, 0.0])[0]), (300.0, 150.0));
    let product = Expression::parse(&vec!["x"; 60].join("*"), &["x", "y"]).unwrap();
    assert!((product.gradient(&[1.0, 0.0])[0] - 60.0).abs() < 1e-9);
    let product = Expression::parse(&vec!["x"; 24].join("*"), &["x", "y"]).unwrap();
    assert!((product.gradient(&[1.0, 0.0])[0] - 24.0).abs() < 1e-9);
    assert!((product.hessian(&[1.0, 0.0])[(0, 0)] - 24.0 * 23.0).abs() < 1e-9);
}

#[test]
fn the_work_of_derivatives_grows_with_the_length_alone() {
    // By symbolic rules their second derivatives would grow with the third power of the length.
    let product = Expression::parse(&vec!["x"; 990].join("*"), &["x", "y"]).unwrap();
    assert!((product.gradient(&[1.0, 0.0])[0] - 990.0).abs() < 1e-9);
    assert!((product.hessian(&[1.0, 0.0])[(0, 0)] - 990.0 * 989.0).abs() < 1e-6);
    let quotient = Expression::parse(&vec!["(x+y)"; 60].join("/"), &["x", "y"]).unwrap();
    // (x + y)^-58.
    assert!((quotient.gradient(&[0.6, 0.4])[1] + 58.0).abs() < 1e-9);
    assert!((quotient.hessian(&[0.6, 0.4])[(0, 1)] - 58.0 * 59.0).abs() < 1e-6);
    let power = Expression::parse("x^60", &["x", "y"]).unwrap();
    assert!((power.hessian(&[1.0, 0.0])[(0, 0)] - 60.0 * 59.0).abs() < 1e-9);
    let terms: Vec<String> = (0..60).map(|k| format!("0.{k}1*x^{}*y^{}", k % 7, k % 5)).collect();
    let polynomial = Expression::parse(&terms.join("+"), &["x", "y"]).unwrap();
    assert!(polynomial.value(&[1.0, 1.0]).is_finite());
}

#[test]
fn long_and_deep_texts_are_refused_not_overflown() {
    for text in ["(".repeat(1500), "-".repeat(1500), "sin(".repeat(400), "2^".repeat(900)] {
        let error = Expression::parse(&text, &["x"]).unwrap_err();
        assert!(error.expected.contains(&MAX_DEPTH.to_string()), "{}", error.expected);
    }
    let error = Expression::parse(&"x+".repeat(MAX_CHARACTERS), &["x"]).unwrap_err();
    assert!(error.expected.contains(&MAX_CHARACTERS.to_string()), "{error}");
    let deep = format!("{}x{}", "(".repeat(MAX_DEPTH / 2 - 1), ")".repeat(MAX_DEPTH / 2 - 1));
    assert_eq!(Expression::parse(&deep, &["x"]).unwrap().value(&[4.0]), 4.0);
}
