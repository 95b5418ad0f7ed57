//! Binary operators on values: numbers, truth values, strings, pos vectors and orients (quaternions).

use nalgebra::Vector3;

use crate::motion::Reason;
use crate::rapid::token::Token;
use crate::rapid::value::Value;

/// The value of `left operator right`; unknown operands give their reason, a type error [`Reason::WrongShape`].
pub(super) fn binary(left: &Value, operator: Token, right: &Value) -> Value {
    match (left, right) {
        (Value::Unknown(reason), _) | (_, Value::Unknown(reason)) => Value::Unknown(*reason),
        (&Value::Number(a), &Value::Number(b)) => match operator {
            Token::Plus => Value::Number(a + b),
            Token::Minus => Value::Number(a - b),
            Token::Star => Value::Number(a * b),
            Token::Slash if b != 0.0 => Value::Number(a / b),
            Token::Div if b.round() != 0.0 => Value::Number((a.round() / b.round()).trunc()),
            Token::Mod if b.round() != 0.0 => Value::Number(a.round().rem_euclid(b.round().abs())),
            Token::Equal => Value::Bool(a == b),
            Token::NotEqual => Value::Bool(a != b),
            Token::Less => Value::Bool(a < b),
            Token::LessEqual => Value::Bool(a <= b),
            Token::Greater => Value::Bool(a > b),
            Token::GreaterEqual => Value::Bool(a >= b),
            _ => Value::Unknown(Reason::WrongShape),
        },
        (&Value::Bool(a), &Value::Bool(b)) => match operator {
            Token::And => Value::Bool(a && b),
            Token::Or => Value::Bool(a || b),
            Token::Xor | Token::NotEqual => Value::Bool(a != b),
            Token::Equal => Value::Bool(a == b),
            _ => Value::Unknown(Reason::WrongShape),
        },
        (Value::Text(a), Value::Text(b)) if operator == Token::Plus => Value::Text([&**a, &**b].concat()),
        (Value::List(_), Value::List(_)) => match (left.numbers::<3>(), right.numbers::<3>(), operator) {
            (Ok(a), Ok(b), Token::Plus) => Value::from_numbers(&[a[0] + b[0], a[1] + b[1], a[2] + b[2]]),
            (Ok(a), Ok(b), Token::Minus) => Value::from_numbers(&[a[0] - b[0], a[1] - b[1], a[2] - b[2]]),
            (Ok(a), Ok(b), Token::Star) => {
                let cross = Vector3::from(a).cross(&Vector3::from(b));
                Value::from_numbers(&[cross.x, cross.y, cross.z])
            }
            _ => match (left.numbers::<4>(), right.numbers::<4>(), operator) {
                (Ok(a), Ok(b), Token::Star) => {
                    let turn = |q: [f64; 4]| nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]);
                    let product = turn(a) * turn(b);
                    Value::from_numbers(&[product.w, product.i, product.j, product.k])
                }
                (Err(reason), _, _) | (_, Err(reason), _) if reason != Reason::WrongShape => {
                    Value::Unknown(reason)
                }
                _ => Value::Unknown(Reason::WrongShape),
            },
        },
        (Value::List(_), &Value::Number(factor)) | (&Value::Number(factor), Value::List(_)) => {
            let list = if matches!(left, Value::List(_)) { left } else { right };
            match (list.numbers::<3>(), operator) {
                (Ok(vector), Token::Star) => Value::from_numbers(&vector.map(|value| value * factor)),
                (Ok(vector), Token::Slash) if matches!(left, Value::List(_)) && factor != 0.0 => {
                    Value::from_numbers(&vector.map(|value| value / factor))
                }
                (Err(reason), _) => Value::Unknown(reason),
                _ => Value::Unknown(Reason::WrongShape),
            }
        }
        _ => Value::Unknown(Reason::WrongShape),
    }
}
