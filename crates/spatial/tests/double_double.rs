//! Double-double arithmetic against exact arithmetic on integers and against 50-digit values.

#![expect(
    clippy::unwrap_used,
    clippy::cast_possible_truncation,
    reason = "a failed step of a test fails it; exponents are small"
)]

use core::f64::consts;
use num_bigint::BigInt;
use num_traits::{Signed, ToPrimitive, Zero};
use proptest::prelude::*;
use vertebra_spatial::{DoubleDouble, Number, Quat, Real, vec3};

/// Binary places of the fixed-point numbers that the tests compute with.
const PLACES: i32 = 700;

/// An f64 between 2^-600 and 2^300 as a fixed-point number, exactly.
fn exact_f64(x: f64) -> BigInt {
    if x == 0.0 {
        return BigInt::zero();
    }
    let bits = x.abs().to_bits();
    let exponent = (bits >> 52) as i32 - 1075;
    let mantissa = BigInt::from((bits & ((1 << 52) - 1)) | (1 << 52));
    let shift = exponent + PLACES;
    assert!(shift >= 0, "{x:e} is too small for the test");
    let magnitude = mantissa << shift;
    if x < 0.0 { -magnitude } else { magnitude }
}

fn exact(x: DoubleDouble) -> BigInt {
    exact_f64(x.hi()) + exact_f64(x.lo())
}

/// A decimal number like -1.25e-3 as a fixed-point number, to its last place.
fn decimal(text: &str) -> BigInt {
    let (digits, exponent) = text.split_once('e').unwrap_or((text, "0"));
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let number: BigInt = format!("{whole}{fraction}").parse().unwrap();
    let places = fraction.len() as i32 - exponent.parse::<i32>().unwrap();
    let power = |n: i32| BigInt::from(10).pow(n.unsigned_abs());
    if places >= 0 {
        (number << PLACES) / power(places)
    } else {
        (number << PLACES) * power(places)
    }
}

/// |a - b| / |scale| in units of u^2 = 2^-106.
fn units(a: &BigInt, b: &BigInt, scale: &BigInt) -> f64 {
    let difference = (a - b).abs();
    if difference.is_zero() {
        return 0.0;
    }
    if scale.is_zero() {
        return f64::INFINITY;
    }
    // A thousandth of a unit is told apart.
    let thousandths: BigInt = difference * (BigInt::from(1000) << 106) / scale.abs();
    thousandths.to_f64().unwrap_or(f64::INFINITY) / 1000.0
}

/// A double-double with all its bits, of any sign and of a size from 2^-40 to 2^40.
fn number() -> impl Strategy<Value = DoubleDouble> {
    let part = || (1.0..2.0_f64, any::<bool>());
    (part(), -40..40_i32, part(), 53..60_i32).prop_map(|((a, s), e, (b, t), gap)| {
        let sign = |negative: bool| if negative { -1.0 } else { 1.0 };
        let hi = sign(s) * a * 2.0_f64.powi(e);
        DoubleDouble::from_sum(hi, sign(t) * b * 2.0_f64.powi(e - gap))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4096))]

    #[test]
    fn arithmetic_errs_by_no_more_than_was_proved(a in number(), b in number()) {
        let (x, y) = (exact(a), exact(b));
        prop_assert!(units(&exact(a + b), &(&x + &y), &(&x + &y)) <= 3.0);
        prop_assert!(units(&exact(a - b), &(&x - &y), &(&x - &y)) <= 3.0);
        let product: BigInt = (&x * &y) >> PLACES;
        prop_assert!(units(&exact(a * b), &product, &product) <= 5.0);
        let quotient: BigInt = (&x << PLACES) / &y;
        prop_assert!(units(&exact(a / b), &quotient, &quotient) <= 5.0);
        let root: BigInt = (x.abs() << PLACES).sqrt();
        prop_assert!(units(&exact(a.abs().sqrt()), &root, &root) <= 25.0 / 8.0);
    }

    /// Nearly equal numbers: what is left is right to the last bit that the two had.
    #[test]
    fn cancellation_costs_nothing(a in number(), step in -200.0..200.0_f64) {
        let b = a * DoubleDouble::from_f64(1.0 + step * f64::EPSILON);
        let difference = exact(a) - exact(b);
        prop_assert!(units(&exact(a - b), &difference, &difference) <= 3.0);
    }

    /// Order is that of the numbers.
    #[test]
    fn comparison(a in number(), b in number()) {
        prop_assert_eq!(a < b, exact(a) < exact(b));
        prop_assert_eq!(a == b, exact(a) == exact(b));
        prop_assert!(a.abs() >= DoubleDouble::ZERO);
        prop_assert_eq!(a.to_f64(), a.hi());
    }

    #[test]
    fn sine_and_cosine_are_on_the_circle_and_the_angle_comes_back(
        hi in -3.1..3.1_f64,
        lo in -1e-17..1e-17_f64,
    ) {
        let angle = DoubleDouble::from_sum(hi, lo);
        let (sin, cos) = angle.sin_cos();
        let eps = DoubleDouble::EPSILON;
        let off = (sin * sin + cos * cos - DoubleDouble::ONE).abs();
        prop_assert!(off < eps + eps, "{off:?}");
        let back = (sin.atan2(cos) - angle).abs();
        prop_assert!(back <= eps * DoubleDouble::from_f64(4.0), "{back:?}");
        // The double angle, by a reduction of another number of quarter turns.
        let (double, _) = (angle + angle).sin_cos();
        let off = (double - (sin * cos + sin * cos)).abs();
        prop_assert!(off < eps + eps, "{off:?}");
    }
}

/// Angle, sine, cosine to 50 digits.
#[rustfmt::skip]
const SINES: &[(f64, &str, &str)] = &[
    (1e-09, "0.0000000010000000000000000621149247911131897210979396305627", "0.99999999999999999949999999999999993776007520888681"),
    (0.1, "0.09983341664682815783019686785861666773596557213437", "0.99500416527802576554137519886234525634808008351528"),
    (0.5, "0.4794255386042030002732879352155713880818033679406", "0.87758256189037271611628158260382965199164519710974"),
    (consts::FRAC_PI_4, "0.70710678118654750275194295621751674626154323953749", "0.70710678118654754604974576799218066950168334142557"),
    (0.7853981633974484, "0.7071067811865475812565658904062677615595456506959", "0.70710678118654746754512283380342574546144855622776"),
    (1.0, "0.84147098480789650665250232163029899962256306079837", "0.54030230586813971740093660744297660373231042061792"),
    (consts::FRAC_PI_2, "0.99999999999999999999999999999999812530027167267801", "6.1232339957367658861303296613750014646403777988363e-17"),
    (2.0, "0.90929742682568169539601986591174484270225497144789", "-0.41614683654714238699756822950076218976600077107554"),
    (3.0, "0.14112000805986722210074480280811027984693326425227", "-0.98999249660044545727157279473126130239367909661559"),
    (consts::PI, "1.2246467991473531772260659322749979970830539012998e-16", "-0.99999999999999999999999999999999250120108669071203"),
    (-3.5, "0.35078322768961984812036880004363558508498173594058", "-0.93645668729079633769865762667176046301995776578196"),
    (4.0, "-0.75680249530792825137263909451182909413591288733647", "-0.65364362086361191463916818309775038142413359664622"),
    (4.71238898038469, "-0.99999999999999999999999999999998312770244505410206", "-1.836970198721029765839098898412491256012026705781e-16"),
    (5.5, "-0.70554032557039190623191917552207007884729028198818", "0.70866977429126000002742118132584373498775839267675"),
    (consts::TAU, "-2.4492935982947063544521318645499776274059345348599e-16", "0.99999999999999999999999999999997000480434676284811"),
    (-100.25, "0.27728285645485130335367205701943588684425598993858", "0.96078833127606120344234456136204998612380108861013"),
    (1000.0, "0.82687954053200256025588742910921814121272496784779", "0.5623790762907029910782492266053959687558118217382"),
    (123456.789, "-0.99866408234322452531014415059945748909048882605165", "0.051672532718701382662876873267419109778947125057336"),
    (1000000000.0, "0.54584344944869956424438727089751452899502293026289", "0.83788718136390233438977564355157235605957694808812"),
    (1000000000000000.0, "0.85827279317023583552388639084840664660020340822073", "-0.51319373778697025223453613642316492958815677124475"),
    (4503599627370495.5, "0.99997567556377550276081972999127581649655603836268", "-0.0069748319528714696286547123382020085995752584699109"),
];

/// y, x, the angle of (x, y) to 50 digits.
#[rustfmt::skip]
const ANGLES: &[(f64, f64, &str)] = &[
    (1.0, 1.0, "0.78539816339744830961566084581987572104929234984378"),
    (1.0, -1.0, "2.3561944901923449288469825374596271631478770495313"),
    (-1.0, -1.0, "-2.3561944901923449288469825374596271631478770495313"),
    (0.0, -1.0, "3.1415926535897932384626433832795028841971693993751"),
    (1.0, 0.0, "1.5707963267948966192313216916397514420985846996876"),
    (-2.5, 0.0, "-1.5707963267948966192313216916397514420985846996876"),
    (1e-09, 3.0, "0.0000000003333333333333333540815181402476064583141079876364"),
    (3.0, 1e-09, "1.5707963264615632858979883375582333018509782413734"),
    (0.1, -0.3, "2.8198420991931510173056631532919272842136446466526"),
    (-7.25, 1000000.0, "-0.0000072499999998729739583373394171222454263482233410803"),
    (1e+200, -1e+200, "2.3561944901923449288469825374596271631478770495313"),
    (1e-12, -100000.0, "3.141592653589793228462643383279503085330693106819"),
];

#[test]
fn trigonometry_agrees_with_fifty_digits() {
    for &(angle, sin, cos) in SINES {
        let (s, c) = DoubleDouble::from_f64(angle).sin_cos();
        for (found, text) in [(s, sin), (c, cos)] {
            let reference = decimal(text);
            let error = units(&exact(found), &reference, &reference);
            assert!(error <= 16.0, "{angle}: {error} units of 2^-106");
        }
    }
    for &(y, x, angle) in ANGLES {
        let found = DoubleDouble::from_f64(y).atan2(DoubleDouble::from_f64(x));
        let reference = decimal(angle);
        let error = units(&exact(found), &reference, &reference);
        assert!(error <= 16.0, "({y}, {x}): {error} units of 2^-106");
    }
}

/// The comparison is one: an f64 sine is 2^53 units off.
#[test]
fn an_error_in_the_seventeenth_digit_is_seen() {
    let (_, sin, _) = SINES[1];
    let reference = decimal(sin);
    let rounded = DoubleDouble::from_f64(0.1_f64.sin());
    let off = units(&exact(rounded), &reference, &reference);
    assert!(off > 2.0_f64.powi(48), "{off}");
}

#[test]
fn edges() {
    let number = DoubleDouble::from_f64;
    assert_eq!(number(0.0).sin_cos(), (number(0.0), number(1.0)));
    assert_eq!(number(1e-300).sin_cos().0, number(1e-300));
    assert_eq!(number(0.0).sqrt(), number(0.0));
    assert_eq!(number(0.0).atan2(number(0.0)), number(0.0));
    // Whole turns that no f64 can hold any more: f64's own answer.
    assert_eq!(number(1e22).sin_cos().0.hi(), 1e22_f64.sin());
    for bad in [
        number(1.0) / number(0.0),
        number(1e300) * number(1e300),
        number(-1.0).sqrt(),
        number(f64::INFINITY) + number(1.0),
        number(f64::NAN).sin_cos().0,
    ] {
        assert!(!bad.is_finite(), "{bad:?}");
        assert!(!bad.to_f64().is_finite(), "{bad:?}");
    }
}

/// Algorithms written over [`Real`] keep the precision: exp and log undo each other.
#[test]
fn rotations() {
    for scale in [1e-12, 1e-7, 1e-3, 1.0, 3.0] {
        let r = vec3(0.48, -0.6, 0.64).map(|x| DoubleDouble::from_f64(x * scale));
        let q = Quat::exp(r);
        let length = (q.length() - DoubleDouble::ONE).abs();
        assert!(length < DoubleDouble::EPSILON, "{length:?}");
        let back = (q.log() - r).length().to_f64();
        assert!(back <= 8.0 * scale * DoubleDouble::EPSILON.hi(), "{back:e}");
    }
}
