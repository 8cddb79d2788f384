/* The gait phase from the shank's angle, in C99: what `afo_sim.control.PhaseEstimate` does, name by name.
 *
 * phase_begin(&p, lead)                once
 * phase_update(&p, angle, dt, struck)  with each sample; believe phase_now(&p) while phase_ready(&p)
 *
 * Constants and templates are written by `python scripts/phase_table.py --c docs/phase.h`.
 */
#include <math.h>
#include <stdint.h>
#include <string.h>

#ifndef PHASE_REAL
#define PHASE_REAL float
#endif
typedef PHASE_REAL real_t;
#define R(x) ((real_t)(x))
#define PHASE_MATH(name) \
    static inline real_t name##_r(real_t x) \
    { \
        return sizeof(real_t) == sizeof(float) ? R(name##f((float)x)) : R(name((double)x)); \
    }
PHASE_MATH(sin)
PHASE_MATH(cos)
PHASE_MATH(exp)
PHASE_MATH(floor)
PHASE_MATH(fabs)

#define STATES (SHAPE + 2 * HARMONICS + 1)
#define NEVER R(1e9)
#define TURN R(6.283185307179586)

/* begin constants */
#define AGAIN R(0.5)
#define AGAINST 2
#define AGREED R(0.9)
#define AGREED_STANDING R(0.75)
#define AGREES R(0.08)
#define AGREES_STRUCK R(0.2)
#define ALIKE R(0.06981317007977318)
#define AVERAGED R(2.0)
#define BACK R(0.05)
#define BEGUN R(0.061086523819801536)
#define BIN R(0.005)
#define BINS 51
#define CALM R(0.02)
#define CALM_MISFIT R(0.04)
#define CERTAIN R(0.04)
#define DIP R(0.047)
#define ENOUGH R(0.5)
#define EXTREMES 128
#define FASTEST R(3.0)
#define FIRST R(0.06981317007977318)
#define FORGOTTEN R(2.5)
#define FROM R(-0.08)
#define GAP R(0.050100000000000006)
#define HALF R(0.035)
#define HARMONICS 6
#define HIGH_PAST R(0.05)
#define HOLD R(10.0)
#define KEPT R(40.0)
#define LATE R(0.08)
#define LEARNT R(0.026179938779914945)
#define LONGEST_HALF 10
#define LONGEST_STRIDE R(5.0)
#define LONGEST_WINDOW R(0.5)
#define LOOK R(0.025)
#define LOOKED R(0.25)
#define LOOKS 20
#define LOST R(0.12217304763960307)
#define LOW_PAST R(0.1)
#define MEAN R(0.10471975511965978)
#define MISFIT R(0.027925268031909273)
#define MOVES R(2.0)
#define NOISY R(0.5)
#define NOTHING R(6.0)
#define PACE R(0.25)
#define PAST R(0.10471975511965978)
#define PHASE R(0.04)
#define RANGE R(0.4363323129985824)
#define RATE R(0.25)
#define RECENT R(0.05)
#define RESIDUAL R(0.006108652381980153)
#define SAMPLE R(0.01)
#define SEEN R(1.5)
#define SETTLED 3
#define SHAPE 2
#define SHARE R(0.2)
#define SHIFT R(0.095)
#define SHORTEST_HALF 3
#define SHORTEST_STRIDE R(0.33)
#define SHORTEST_WINDOW R(0.25)
#define SIZE R(0.28)
#define SLOWEST R(0.2)
#define SPREAD R(0.025)
#define STILL R(0.015707963267948967)
#define STRIKE R(0.006)
#define SURE R(0.9)
#define TAUGHT R(0.3)
#define UNLIKE R(0.003490658503988659)
#define UNLIKE_SWING R(0.13962634015954636)
#define UNSTEADY R(0.3)
#define WAKING_PHASE R(0.03)
#define WAKING_RATE R(0.3)
#define WEIGHTS { R(0.111111111), R(0.222222222), R(0.333333333), R(0.222222222), R(0.111111111) }
/* end constants */

typedef struct {
    real_t stride_time, lowest, highest, low, high;
    real_t series[STATES - SHAPE];
} template_t;
/* begin templates: stride time, phases of the lowest and highest angle, the angles, the series */
#define TEMPLATES 39
static const template_t templates[TEMPLATES] = {
    {R(0.6), R(0.9765625), R(0.65625), R(-0.335076495), R(0.912522041),
      {R(0.283374761), R(-0.422807067), R(-0.250322471), R(-0.150821654), R(0.150166312), R(-0.00886930941), R(0.0356392324), R(-0.012097385), R(0.0130161603), R(-0.00330476458), R(0.00665767261), R(-0.000716848935), R(0.00143868801)}},
    {R(0.65), R(0.9765625), R(0.65625), R(-0.335076495), R(0.912522041),
      {R(0.283374761), R(-0.422807067), R(-0.250322471), R(-0.150821654), R(0.150166312), R(-0.00886930941), R(0.0356392324), R(-0.012097385), R(0.0130161603), R(-0.00330476458), R(0.00665767261), R(-0.000716848935), R(0.00143868801)}},
    {R(0.7), R(0.9765625), R(0.65625), R(-0.335076495), R(0.912522041),
      {R(0.283374761), R(-0.422807067), R(-0.250322471), R(-0.150821654), R(0.150166312), R(-0.00886930941), R(0.0356392324), R(-0.012097385), R(0.0130161603), R(-0.00330476458), R(0.00665767261), R(-0.000716848935), R(0.00143868801)}},
    {R(0.75), R(0.9765625), R(0.65625), R(-0.335076495), R(0.912522041),
      {R(0.283374761), R(-0.422807067), R(-0.250322471), R(-0.150821654), R(0.150166312), R(-0.00886930941), R(0.0356392324), R(-0.012097385), R(0.0130161603), R(-0.00330476458), R(0.00665767261), R(-0.000716848935), R(0.00143868801)}},
    {R(0.8), R(0.9765625), R(0.65625), R(-0.335076495), R(0.912522041),
      {R(0.283374761), R(-0.422807067), R(-0.250322471), R(-0.150821654), R(0.150166312), R(-0.00886930941), R(0.0356392324), R(-0.012097385), R(0.0130161603), R(-0.00330476458), R(0.00665767261), R(-0.000716848935), R(0.00143868801)}},
    {R(0.85), R(0.9765625), R(0.65625), R(-0.334930414), R(0.912321256),
      {R(0.28262558), R(-0.417525745), R(-0.254696841), R(-0.155986675), R(0.147589481), R(-0.00881117421), R(0.0377314998), R(-0.0118931039), R(0.0126224456), R(-0.00349766638), R(0.00695707904), R(-0.000512038059), R(0.00157925998)}},
    {R(0.9), R(0.9765625), R(0.6640625), R(-0.334784991), R(0.912557001),
      {R(0.281876437), R(-0.412197904), R(-0.25896278), R(-0.161076317), R(0.144804195), R(-0.00892536318), R(0.0398864164), R(-0.0116034752), R(0.0122658082), R(-0.00372804661), R(0.00721489884), R(-0.000309446805), R(0.00175863333)}},
    {R(0.95), R(0.9765625), R(0.6640625), R(-0.334640641), R(0.912454475),
      {R(0.281127317), R(-0.406825901), R(-0.263119881), R(-0.166081869), R(0.141813842), R(-0.00921792221), R(0.0420915071), R(-0.0112321121), R(0.0119582205), R(-0.0039880997), R(0.00742516222), R(-0.00011703922), R(0.00197721801)}},
    {R(1), R(0.9765625), R(0.671875), R(-0.334496945), R(0.91255045),
      {R(0.280378204), R(-0.401412091), R(-0.26716779), R(-0.170994797), R(0.138622182), R(-0.0096939887), R(0.0443338399), R(-0.0107840227), R(0.0117113045), R(-0.0042690684), R(0.0075831516), R(5.71638517e-05), R(0.00223383793)}},
    {R(1.05), R(0.9765625), R(0.671875), R(-0.334352591), R(0.912551594),
      {R(0.279629082), R(-0.39595883), R(-0.271106205), R(-0.175806761), R(0.135233336), R(-0.0103577603), R(0.0466000933), R(-0.0102655723), R(0.0115361812), R(-0.00456142943), R(0.00768554096), R(0.00020538174), R(0.0025257301)}},
    {R(1.1), R(0.9765625), R(0.6796875), R(-0.33420533), R(0.912442782),
      {R(0.278879951), R(-0.390468496), R(-0.274934894), R(-0.180509623), R(0.131651812), R(-0.0112124542), R(0.0488765956), R(-0.00968446053), R(0.0114433391), R(-0.0048550664), R(0.00773051641), R(0.000320348901), R(0.00284857078)}},
    {R(1.15), R(0.9765625), R(0.6796875), R(-0.334051966), R(0.912552882),
      {R(0.27813084), R(-0.384943509), R(-0.27865372), R(-0.185095466), R(0.127882518), R(-0.0122602612), R(0.0511493767), R(-0.00904968645), R(0.0114424893), R(-0.00513946799), R(0.00771788971), R(0.000395604537), R(0.0031965402)}},
    {R(1.2), R(0.9765625), R(0.6875), R(-0.333888449), R(0.912172321),
      {R(0.277381733), R(-0.379386209), R(-0.282262538), R(-0.18955664), R(0.123930605), R(-0.0135023991), R(0.053404382), R(-0.00837132062), R(0.0115423643), R(-0.00540411828), R(0.00764911248), R(0.000425858249), R(0.00356260889)}},
    {R(1.25), R(0.9765625), R(0.6875), R(-0.333709938), R(0.912396765),
      {R(0.276632613), R(-0.373798931), R(-0.285761259), R(-0.193885751), R(0.11980154), R(-0.0149390731), R(0.0556274536), R(-0.0076604874), R(0.0117506521), R(-0.00563863738), R(0.00752729561), R(0.00040714508), R(0.00393868176)}},
    {R(1.3), R(0.9765625), R(0.6875), R(-0.333510913), R(0.911886529),
      {R(0.275883464), R(-0.368184004), R(-0.289149841), R(-0.19807567), R(0.115501092), R(-0.0165694712), R(0.0578044051), R(-0.00692925396), R(0.0120738828), R(-0.00583302415), R(0.00735719506), R(0.000337024813), R(0.00431584192)}},
    {R(1.35), R(0.984375), R(0.6953125), R(-0.333466331), R(0.912026531),
      {R(0.275134268), R(-0.36254375), R(-0.292428292), R(-0.202119546), R(0.111035325), R(-0.0183917647), R(0.0599210952), R(-0.00619051001), R(0.0125173267), R(-0.00597789447), R(0.00714516482), R(0.000214736828), R(0.00468462673)}},
    {R(1.4), R(0.984375), R(0.6953125), R(-0.333540628), R(0.911615533),
      {R(0.274385189), R(-0.356880724), R(-0.295596941), R(-0.206010859), R(0.106410937), R(-0.0204028228), R(0.0619632845), R(-0.00545819311), R(0.0130848353), R(-0.0060645266), R(0.00689938827), R(4.14120559e-05), R(0.0050349837)}},
    {R(1.45), R(0.984375), R(0.703125), R(-0.333593587), R(0.911398522),
      {R(0.273636131), R(-0.351197106), R(-0.298655794), R(-0.20974338), R(0.101634367), R(-0.0225988909), R(0.0639172884), R(-0.00474626428), R(0.0137788488), R(-0.00608563608), R(0.00662906472), R(-0.000180000075), R(0.00535748323)}},
    {R(1.5), R(0.984375), R(0.703125), R(-0.333618797), R(0.911092791),
      {R(0.27288704), R(-0.345495132), R(-0.301604963), R(-0.213311184), R(0.0967123863), R(-0.0249751889), R(0.0657696112), R(-0.00406916873), R(0.0146003544), R(-0.00603513204), R(0.00634468256), R(-0.000444763474), R(0.00564303344)}},
    {R(1.55), R(0.984375), R(0.7109375), R(-0.333609726), R(0.910486167),
      {R(0.272137898), R(-0.339777074), R(-0.304444659), R(-0.216708668), R(0.0916520691), R(-0.0275259214), R(0.067507042), R(-0.00344167177), R(0.0155488055), R(-0.00590834307), R(0.00605787135), R(-0.00074636296), R(0.00588322373)}},
    {R(1.6), R(0.984375), R(0.7109375), R(-0.333559982), R(0.910292798),
      {R(0.271388688), R(-0.334045192), R(-0.307175142), R(-0.219930564), R(0.0864607043), R(-0.0302443599), R(0.0691167709), R(-0.00287862868), R(0.0166220998), R(-0.0057022246), R(0.00578114756), R(-0.00107663328), R(0.00607071758)}},
    {R(1.65), R(0.984375), R(0.71875), R(-0.333463495), R(0.909286333),
      {R(0.27063944), R(-0.328301786), R(-0.3097968), R(-0.222971975), R(0.081145872), R(-0.0331227773), R(0.0705864311), R(-0.0023948984), R(0.0178165002), R(-0.0054155081), R(0.00552779401), R(-0.00142584402), R(0.00619950907)}},
    {R(1.7), R(0.984375), R(0.71875), R(-0.333314581), R(0.90921587),
      {R(0.26989047), R(-0.322549448), R(-0.312310552), R(-0.225828603), R(0.0757158498), R(-0.0361520103), R(0.0719041228), R(-0.00200546639), R(0.0191262533), R(-0.00504898778), R(0.00531206828), R(-0.00178244748), R(0.00626511428)}},
    {R(1.75), R(0.984375), R(0.71875), R(-0.333109001), R(0.908300014),
      {R(0.269141445), R(-0.316790015), R(-0.3147163), R(-0.228496041), R(0.0701778709), R(-0.0393233339), R(0.0730588422), R(-0.00172395214), R(0.0205449337), R(-0.00460523346), R(0.00514709737), R(-0.00213510331), R(0.00626554025)}},
    {R(1.8), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
    {R(1.85), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
    {R(1.9), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
    {R(1.95), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
    {R(2), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
    {R(2.05), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
    {R(2.1), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
    {R(2.15), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
    {R(2.2), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
    {R(2.25), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
    {R(2.3), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
    {R(2.35), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
    {R(2.4), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
    {R(2.45), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
    {R(2.5), R(0.984375), R(0.7265625), R(-0.332843226), R(0.907887506),
      {R(0.268392349), R(-0.311025678), R(-0.317014495), R(-0.230970437), R(0.0645399098), R(-0.0426266489), R(0.0740400431), R(-0.00156392597), R(0.0220642399), R(-0.00408880219), R(0.00504653993), R(-0.00247131159), R(0.00620050635)}},
};
/* end templates */

typedef struct {
    real_t lead, window, since_look, looks[LOOKS][2]; /* the latest last: angle, phase */
    real_t state[STATES], covariance[STATES][STATES], wave[STATES];
    real_t age, agreed, misfit, worst, stated, rate, cadence, origin, unstruck, since_strike, since_swing;
    real_t noise, calm, surprise, last; /* `last` is NEVER where there was no sample */
    real_t gap; /* since the last sample that was not lost */
    real_t before, high, low, since_high, since_low; /* of a swing that is looked for */
    real_t home[2], now[2], before_it[2]; /* extremes of usual swings, of late, of the last: high, low */
    real_t shift, heel, mean[BINS], count[BINS]; /* of the heel strike */
    uint8_t looked, follows, stopped, falls, has_kept, against, calibrated, knows_swings, strange, off_pace, same, heel_seen, begun;
    template_t kept;
} phase_t;

static inline real_t least(real_t a, real_t b) { return a < b ? a : b; }
static inline real_t most(real_t a, real_t b) { return a > b ? a : b; }
static inline real_t apart(real_t a, real_t b)
{
    const real_t off = a - b + R(0.5);
    return off - floor_r(off) - R(0.5);
}

static real_t phase_series(const real_t *shape, real_t phase, real_t *wave)
{
    const real_t one = cos_r(TURN * phase), two = sin_r(TURN * phase);
    real_t cosine = 1, sine = 0, signal = shape[0];
    wave[0] = wave[1] = 0;
    wave[SHAPE] = 1;
    for (int k = 1; k <= HARMONICS; k++) {
        const real_t next = cosine * one - sine * two;
        sine = sine * one + cosine * two;
        cosine = next;
        wave[2 * k + 1] = cosine;
        wave[2 * k + 2] = sine;
        signal += shape[2 * k - 1] * cosine + shape[2 * k] * sine;
        wave[0] += TURN * (real_t)k * (shape[2 * k] * cosine - shape[2 * k - 1] * sine);
    }
    return signal;
}

static void phase_template(template_t *t, real_t stride_time, const real_t *series)
{
    real_t wave[STATES];
    int lowest = 0, highest = 0;
    memcpy(t->series, series, sizeof t->series);
    t->stride_time = stride_time;
    for (int k = 0; k < EXTREMES; k++) {
        const real_t angle = phase_series(series, (real_t)k / EXTREMES, wave);
        if (k == 0 || angle < t->low) { t->low = angle; lowest = k; }
        if (k == 0 || angle > t->high) { t->high = angle; highest = k; }
    }
    t->lowest = (real_t)(lowest > highest ? lowest : lowest + EXTREMES) / EXTREMES;
    t->highest = (real_t)highest / EXTREMES;
}

static void phase_correct(phase_t *p, const real_t *wave, real_t error, real_t variance)
{
    real_t spread[STATES];
    for (int i = 0; i < STATES; i++) {
        spread[i] = 0;
        for (int j = 0; j < STATES; j++)
            spread[i] += p->covariance[i][j] * wave[j];
    }
    for (int i = 0; i < STATES; i++)
        variance += wave[i] * spread[i];
    for (int i = 0; i < STATES; i++) {
        const real_t gain = spread[i] / variance;
        p->state[i] += gain * error;
        for (int j = 0; j <= i; j++)
            p->covariance[i][j] = p->covariance[j][i] -= gain * spread[j];
    }
}

static void phase_loosen(phase_t *p, real_t phase, real_t rate)
{
    for (int j = 0; j < STATES; j++)
        p->covariance[0][j] = p->covariance[1][j] = p->covariance[j][0] = p->covariance[j][1] = 0;
    p->covariance[0][0] = phase;
    p->covariance[1][1] = rate;
}

static inline real_t phase_origin(const phase_t *p)
{
    return R(atan2((double)p->state[SHAPE + 2], (double)p->state[SHAPE + 1])) / TURN;
}

static void phase_turn(phase_t *p, real_t shift)
{
    const real_t one = cos_r(TURN * shift), two = sin_r(TURN * shift);
    real_t cosine = 1, sine = 0;
    p->state[0] += shift;
    for (int k = 1; k <= HARMONICS; k++) {
        real_t *a = &p->state[2 * k + 1], *b = &p->state[2 * k + 2];
        const real_t next = cosine * one - sine * two, before = *a;
        sine = sine * one + cosine * two;
        cosine = next;
        *a = before * cosine - *b * sine;
        *b = before * sine + *b * cosine;
    }
}

static void phase_forget_swing(phase_t *p)
{
    p->falls = 0;
    p->before = p->low = NEVER;
    p->high = -NEVER;
    p->since_high = p->since_low = 0;
    p->since_swing = p->since_strike = p->unstruck = NEVER;
}

static void phase_begin(phase_t *p, real_t lead)
{
    memset(p, 0, sizeof *p);
    phase_forget_swing(p);
    p->lead = lead;
    p->window = LONGEST_WINDOW;
    p->stated = -NEVER;
    p->last = NEVER;
}

static inline int phase_ready(const phase_t *p)
{
    return p->follows && !p->strange && !p->off_pace && p->agreed >= AGREED && p->covariance[0][0] < CERTAIN * CERTAIN;
}
/* What phase 0 is known from: 2 a foot switch, 1 the shank's dip at heel strike, 0 other people's. */
static inline int phase_heel_strike(const phase_t *p) { return p->calibrated ? 2 : p->heel_seen; }
static inline real_t phase_left_over(real_t gain)
{
    gain = least(gain, 1);
    return gain / (2 - gain);
}
static inline real_t phase_now(const phase_t *p) { return p->stated - floor_r(p->stated); }
static inline int phase_enough(const phase_t *p) { return (int)(p->window / LOOK + R(0.5)); }

static int phase_stands(phase_t *p, real_t dt)
{
    const int enough = phase_enough(p);
    real_t mean = 0, square = 0;
    p->since_look += dt;
    if (p->gap > 0 || p->since_look < LOOK - R(1e-4))
        return p->stopped;
    p->since_look = 0;
    memmove(p->looks[0], p->looks[1], sizeof p->looks - sizeof p->looks[0]);
    p->looks[LOOKS - 1][0] = p->calm;
    p->looks[LOOKS - 1][1] = p->state[0];
    if (p->looked < LOOKS)
        p->looked++;
    for (int k = LOOKS - enough; k < LOOKS; k++)
        mean += p->looks[k][0] / (real_t)enough;
    for (int k = LOOKS - enough; k < LOOKS; k++)
        square += (p->looks[k][0] - mean) * (p->looks[k][0] - mean) / (real_t)enough;
    return p->looked >= enough && square - p->noise * phase_left_over(dt / CALM) < STILL * STILL;
}

static void phase_agree(phase_t *p, real_t surprise, real_t part)
{
    const real_t change = surprise - p->last, calm = least(part / CALM_MISFIT, 1);
    if (p->agreed > 0 && p->last < NEVER)
        p->noise += least(part / NOISY, 1) * (R(0.5) * change * change - p->noise);
    p->last = surprise;
    p->surprise += calm * (surprise - p->surprise);
    p->misfit += least(part / RECENT, 1) * (p->surprise * p->surprise - phase_left_over(calm) * p->noise - p->misfit);
    p->worst = most(p->worst, p->misfit);
    p->agreed = p->misfit < MISFIT * MISFIT ? p->agreed + part : 0;
}

static inline void phase_averaged(phase_t *p, real_t dt)
{
    p->rate += (p->state[1] - p->rate) * least(AVERAGED * dt * most(p->rate, SLOWEST), 1);
}

static void phase_stand(phase_t *p, real_t dt, int begins)
{
    const real_t gone = p->state[0] - p->looks[LOOKS - phase_enough(p)][1];
    real_t off;
    phase_forget_swing(p);
    if (!p->follows)
        return;
    if (begins && gone > 0 && gone < R(0.5))
        p->stated = (p->state[0] -= gone) - p->shift;
    if (begins && p->has_kept) {
        memcpy(p->state + SHAPE, p->kept.series, sizeof p->kept.series);
        p->off_pace = 0;
    }
    p->state[1] = 0;
    for (int j = 0; j < STATES; j++)
        p->covariance[1][j] = p->covariance[j][1] = 0;
    p->covariance[1][1] = WAKING_RATE * WAKING_RATE;
    p->covariance[0][0] = most(p->covariance[0][0], WAKING_PHASE * WAKING_PHASE);
    off = fabs_r(p->calm - phase_series(p->state + SHAPE, p->state[0], p->wave)) - CERTAIN * fabs_r(p->wave[0]);
    p->misfit = off > 0 ? off * off : 0;
    p->agreed = p->misfit < MISFIT * MISFIT && p->has_kept ? AGREED_STANDING : 0;
    phase_averaged(p, dt);
}

static int phase_swing(phase_t *p, real_t value, real_t dt)
{
    p->since_high += dt;
    p->since_low += dt;
    if (p->gap > 0)
        return 0;
    if (p->falls) {
        if (value < p->low) {
            p->low = value;
            p->since_low = 0;
        }
        return value >= p->low + PAST;
    }
    p->before = least(p->before, value);
    if (value > p->high || (value < p->high - PAST && p->high - p->before <= RANGE)) {
        p->high = value; /* nothing came before a fall from it */
        p->since_high = 0;
    } else if (value < p->high - PAST) {
        p->falls = 1;
        p->low = value;
        p->since_low = 0;
    }
    return 0;
}

static int phase_alike(const real_t *one, const real_t *other)
{
    return fabs_r(one[0] - other[0]) < ALIKE && fabs_r(one[1] - other[1]) < ALIKE;
}

static void phase_usual(phase_t *p)
{
    const real_t swing[2] = { p->high, p->low };
    int home, again;
    if (!p->knows_swings) {
        memcpy(p->home, swing, sizeof swing);
        memcpy(p->now, swing, sizeof swing);
        memcpy(p->before_it, swing, sizeof swing);
        p->knows_swings = 1;
        return;
    }
    home = phase_alike(swing, p->home);
    again = phase_alike(swing, p->before_it);
    p->strange = (uint8_t)!(home || phase_alike(swing, p->now));
    p->same = (uint8_t)(home || !again ? 0 : p->same < SETTLED ? p->same + 1 : SETTLED);
    memcpy(p->before_it, swing, sizeof swing);
    if (home) {
        for (int k = 0; k < 2; k++)
            p->now[k] = p->home[k] += TAUGHT * (swing[k] - p->home[k]);
    } else if (p->same >= SETTLED) {
        memcpy(p->now, swing, sizeof swing);
        p->strange = 0;
    }
}

static void heel_take(phase_t *p, real_t left, real_t gone)
{
    const real_t off = p->state[0] - FROM, place = (off - floor_r(off)) / BIN;
    const int first = (int)place;
    if (first >= BINS - 1)
        return;
    for (int k = first; k <= first + 1; k++) {
        const real_t share = k > first ? place - (real_t)first : 1 - place + (real_t)first;
        p->count[k] += share;
        if (p->count[k] > 0)
            p->mean[k] += share / p->count[k] * (left - p->mean[k]);
        p->count[k] = least(p->count[k], KEPT * BIN / most(gone, R(1e-5)));
    }
}

static void heel_find(phase_t *p)
{
    static const real_t weights[] = WEIGHTS;
    const int spare = (int)(sizeof weights / sizeof *weights) / 2;
    const int half = (int)(least(most(HALF * p->rate / BIN, SHORTEST_HALF), LONGEST_HALF) + R(0.5));
    real_t score[BINS], best = R(0.5) * NOTHING, whole = 0, seen = 0, mean = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int middle = half + spare; middle < BINS - half - spare; middle++) {
            const real_t place = FROM + BIN * (real_t)middle - DIP * p->rate;
            if (pass) {
                const real_t weight = exp_r(score[middle] - best);
                seen += weight;
                mean += weight * place;
                continue;
            }
            real_t dip = 0, variance = 0;
            for (int k = -spare; k <= spare; k++) {
                const real_t weight = weights[k + spare];
                const int at[] = { middle + k - half, middle + k, middle + k + half };
                for (int i = 0; i < 3; i++) {
                    const real_t factor = R(i == 1 ? -2 : 1), count = p->count[at[i]];
                    dip += weight * factor * p->mean[at[i]];
                    variance += weight * weight * factor * factor / (count > ENOUGH ? count : R(1e-9));
                }
            }
            dip = most(dip, 0);
            score[middle] = R(0.5) * (dip * dip / (p->noise * variance + RESIDUAL * RESIDUAL) - place * place / (SPREAD * SPREAD));
            best = most(best, score[middle]);
        }
    whole = seen + exp_r(R(0.5) * NOTHING - best);
    p->heel = mean / whole;
    p->heel_seen = seen > SURE * whole;
}

static void phase_swung(phase_t *p, real_t late)
{
    const real_t duration = p->since_high - p->since_low, ago = p->since_low + late, stride = p->since_swing - ago;
    const template_t *like = templates, *t;
    template_t shape;
    real_t rate, phase, share, first;
    for (int k = 1; k < TEMPLATES; k++) {
        t = &templates[k];
        if (fabs_r((t->lowest - t->highest) * t->stride_time - duration)
            < fabs_r((like->lowest - like->highest) * like->stride_time - duration))
            like = t;
    }
    if (p->against >= AGAINST)
        p->has_kept = 0;
    t = p->has_kept ? &p->kept : like;
    rate = (t->lowest - t->highest) / duration;
    if (!(rate > SLOWEST && rate < FASTEST))
        return;
    phase_usual(p);
    p->off_pace = 0;
    p->window = least(most(SHARE * like->stride_time, SHORTEST_WINDOW), LONGEST_WINDOW);
    p->since_swing = ago;
    if (stride > SHORTEST_STRIDE && stride < LONGEST_STRIDE)
        p->cadence = 1 / stride;
    else if (!(p->cadence > 0))
        p->cadence = rate;
    phase = t->lowest + rate * ago;
    phase_template(&shape, like->stride_time, p->state + SHAPE);
    if (!p->follows || fabs_r(apart(p->state[0], phase)) > (p->unstruck < SEEN ? AGREES_STRUCK : AGREES)
        || most(fabs_r(shape.high - p->high), fabs_r(shape.low - p->low)) > UNLIKE_SWING || p->worst > LOST * LOST) {
        share = (p->high - p->low) / (t->high - t->low);
        for (int k = SHAPE; k < STATES; k++)
            p->state[k] = share * t->series[k - SHAPE];
        p->state[SHAPE] += R(0.5) * (p->high + p->low - share * (t->high + t->low));
        if (!p->calibrated)
            p->origin = phase_origin(p);
        first = FIRST * (p->has_kept ? AGAIN : 1);
        memset(p->covariance, 0, sizeof p->covariance);
        p->covariance[SHAPE][SHAPE] = MEAN * MEAN;
        for (int k = SHAPE + 1; k < STATES; k++)
            p->covariance[k][k] = first * first / (real_t)(((k - 1) / 2) * ((k - 1) / 2));
        if (!p->has_kept) {
            p->age = 0;
            memset(p->mean, 0, sizeof p->mean);
            memset(p->count, 0, sizeof p->count);
        }
        p->against = (uint8_t)(p->against < AGAINST ? p->against + 1 : AGAINST);
        p->follows = 1;
        p->stated = -NEVER;
        p->agreed = p->misfit = p->surprise = 0;
        p->last = NEVER;
        p->rate = p->state[1] = p->cadence;
        p->state[0] = phase;
        if (p->calibrated)
            phase_turn(p, apart(p->origin, phase_origin(p)));
        phase_loosen(p, PHASE * PHASE, RATE * rate * RATE * rate);
    } else {
        p->against = 0;
        if (p->agreed > 1 && !p->strange) {
            p->kept = shape;
            p->has_kept = 1;
        }
    }
    p->worst = 0;
}

static void phase_strike(phase_t *p, real_t dt)
{
    const real_t late = apart(p->shift + R(0.5) * dt * p->state[1], p->state[0]), striking[STATES] = { 1 };
    if (p->since_strike > SHORTEST_STRIDE && p->since_strike < LONGEST_STRIDE)
        p->cadence = 1 / p->since_strike;
    if (fabs_r(late) < LATE) {
        phase_correct(p, striking, late, STRIKE * STRIKE);
    } else {
        if (p->misfit < MISFIT * MISFIT) {
            phase_turn(p, late);
        } else {
            p->state[0] += late;
            p->state[1] = p->cadence;
        }
        phase_loosen(p, STRIKE * STRIKE, R(0.25) * RATE * RATE * p->cadence * p->cadence);
        p->stated = -NEVER;
        p->agreed = 0;
    }
    p->unstruck = 0;
    p->since_strike = R(0.5) * dt;
    p->last = NEVER; /* the phase has jumped, and what is expected with it */
}

static int phase_passed(const phase_t *p, real_t began, real_t at)
{
    const real_t before = apart(began, at);
    return before > R(-0.2) && before < 0 && apart(p->state[0], at) >= 0;
}

static void phase_look(phase_t *p, real_t began)
{
    if (p->unstruck > SEEN && !p->calibrated && phase_passed(p, began, LOOKED))
        heel_find(p);
    if (!(p->since_swing < NEVER))
        return; /* he has stood, and begins as he likes */
    if (fabs_r(p->state[1] - p->cadence) > PACE * p->cadence)
        p->off_pace = 1;
    if (p->has_kept && phase_passed(p, began, p->kept.highest + HIGH_PAST) && p->knows_swings && p->high < p->now[0] - ALIKE)
        p->strange = 1;
    if (p->has_kept && phase_passed(p, began, p->kept.lowest + LOW_PAST) && p->since_swing * p->state[1] > R(0.5))
        p->strange = 1; /* no swing has ended here */
}

static void phase_follow(phase_t *p, real_t value, real_t dt, int struck)
{
    real_t *state = p->state, error, surprise, phase;
    const real_t began = state[0], rate = state[1], gone = rate * dt;
    const real_t loose = dt * most(rate, SLOWEST) * least(most(p->misfit, 0) / (LEARNT * LEARNT), 1);
    p->age += gone;
    p->unstruck += gone;
    state[0] += dt * rate;
    for (int j = 0; j < STATES; j++)
        p->covariance[0][j] += dt * p->covariance[1][j];
    for (int j = 0; j < STATES; j++)
        p->covariance[j][0] += dt * p->covariance[j][1];
    p->covariance[1][1] += dt * UNSTEADY * UNSTEADY * most(rate * rate * rate, R(0.1));
    p->covariance[SHAPE][SHAPE] += dt * UNLIKE * UNLIKE + loose * SHIFT * SHIFT;
    for (int i = SHAPE + 1; i < STATES; i++) {
        const real_t size = loose * SIZE * SIZE * state[i];
        p->covariance[i][i] += dt * UNLIKE * UNLIKE / (real_t)(((i - 1) / 2) * ((i - 1) / 2));
        for (int j = SHAPE + 1; j <= i; j++)
            p->covariance[i][j] = p->covariance[j][i] += size * state[j];
    }
    if (!(p->gap > 0)) {
        surprise = value - phase_series(state + SHAPE, state[0], p->wave);
        phase_agree(p, surprise, most(gone, R(0.5) * dt));
        error = LEARNT + (BEGUN - LEARNT) * exp_r(-p->age / FORGOTTEN);
        phase_correct(p, p->wave, surprise, error * error * SAMPLE / dt + p->noise);
        if (p->agreed > R(0.5) && !p->strange)
            heel_take(p, surprise, gone);
    }
    if (struck)
        phase_strike(p, dt);
    if (p->unstruck > SEEN) {
        phase_turn(p, gone * HOLD * apart(p->origin, phase_origin(p)));
    } else if (p->agreed > 1 && !p->strange) {
        p->origin = phase_origin(p);
        p->calibrated = 1;
    }
    phase_look(p, began);
    p->shift += least(MOVES * gone, 1) * (p->heel - p->shift);
    state[1] = least(most(state[1], 0), FASTEST);
    phase_averaged(p, dt);
    phase = state[0] + state[1] * p->lead - p->shift;
    if (!(p->stated > phase && p->stated - phase < BACK))
        p->stated = phase;
}

/* A sample of the shank's angle [rad], NaN where it was lost, time since the one before [s], whether the heel has
 * struck in it. */
static void phase_update(phase_t *p, real_t value, real_t dt, int struck)
{
    const uint8_t stood = p->stopped;
    const real_t lost = p->gap;
    if (!(dt > 0))
        return;
    p->gap = value - value == 0 ? 0 : p->gap + dt;
    if (!(p->gap > 0)) {
        p->calm = p->begun && lost <= SHORTEST_WINDOW ? p->calm + least((dt + lost) / CALM, 1) * (value - p->calm) : value;
        p->begun = 1;
    }
    if (p->gap > GAP)
        p->agreed = 0;
    if (p->gap > SHORTEST_WINDOW + R(1e-4))
        phase_forget_swing(p);
    p->stopped = (uint8_t)phase_stands(p, dt);
    p->since_swing = least(p->since_swing + dt, NEVER);
    p->since_strike = least(p->since_strike + dt, NEVER);
    if (p->stopped) {
        if (!(p->gap > 0))
            phase_stand(p, dt, !stood);
        return;
    }
    if (stood)
        p->state[1] = p->cadence;
    if (phase_swing(p, p->calm, dt)) {
        if (p->high - p->low > RANGE)
            phase_swung(p, most(CALM - dt, 0));
        p->falls = 0;
        p->before = p->low;
        p->high = p->calm;
        p->since_high = 0;
    }
    if (p->follows)
        phase_follow(p, value, dt, struck);
}
