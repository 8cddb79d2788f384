/* The gait phase from the shank's angle, in C99: what `afo_sim.control.PhaseEstimate` does, name by name.
 *
 * phase_begin(&p, lead)                once
 * phase_update(&p, angle, dt, struck)  with each sample; believe phase_now(&p) while phase_ready(&p)
 * Before the first swing it is 0, where Python says NaN.
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
#define ANGLE_FILTER R(0.02)
#define AVERAGED R(2.0)
#define BACK R(0.05)
#define BEGUN R(0.061086523819801536)
#define BIN R(0.005)
#define BINS 51
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
#define MISFIT_FILTER R(0.04)
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
#define SHARE R(0.28)
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
#define UNEVEN 3
#define UNLIKE R(0.003490658503988659)
#define UNLIKE_SWING R(0.13962634015954636)
#define UNSTEADY R(0.3)
#define USUAL R(0.1)
#define WAKING_PHASE R(0.03)
#define WAKING_RATE R(0.3)
#define WEIGHTS { R(0.1111111111111111), R(0.22222222222222221), R(0.33333333333333331), R(0.22222222222222221), R(0.1111111111111111) }
#define COSINES { R(1), R(0.99879545620517241), R(0.99518472667219693), R(0.98917650996478101), R(0.98078528040323043), R(0.97003125319454397), R(0.95694033573220882), R(0.94154406518302081), R(0.92387953251128674), R(0.90398929312344334), R(0.88192126434835505), R(0.85772861000027212), R(0.83146961230254524), R(0.80320753148064494), R(0.77301045336273699), R(0.74095112535495911), R(0.70710678118654757), R(0.67155895484701833), R(0.63439328416364549), R(0.59569930449243347), R(0.55557023301960229), R(0.51410274419322166), R(0.47139673682599781), R(0.4275550934302822), R(0.38268343236508984), R(0.33688985339222005), R(0.29028467725446233), R(0.24298017990326398), R(0.19509032201612833), R(0.14673047445536175), R(0.09801714032956077), R(0.049067674327418126), R(6.123233995736766e-17), R(-0.049067674327418008), R(-0.098017140329560645), R(-0.14673047445536164), R(-0.19509032201612819), R(-0.24298017990326387), R(-0.29028467725446216), R(-0.33688985339221994), R(-0.38268343236508973), R(-0.42755509343028186), R(-0.4713967368259977), R(-0.51410274419322166), R(-0.55557023301960196), R(-0.59569930449243336), R(-0.63439328416364538), R(-0.67155895484701844), R(-0.70710678118654746), R(-0.74095112535495888), R(-0.77301045336273699), R(-0.80320753148064483), R(-0.83146961230254535), R(-0.85772861000027201), R(-0.88192126434835494), R(-0.90398929312344334), R(-0.92387953251128674), R(-0.9415440651830207), R(-0.95694033573220882), R(-0.97003125319454397), R(-0.98078528040323043), R(-0.98917650996478101), R(-0.99518472667219682), R(-0.99879545620517241), R(-1), R(-0.99879545620517241), R(-0.99518472667219693), R(-0.98917650996478101), R(-0.98078528040323043), R(-0.97003125319454397), R(-0.95694033573220894), R(-0.94154406518302081), R(-0.92387953251128685), R(-0.90398929312344345), R(-0.88192126434835505), R(-0.85772861000027212), R(-0.83146961230254546), R(-0.80320753148064494), R(-0.7730104533627371), R(-0.74095112535495911), R(-0.70710678118654768), R(-0.67155895484701866), R(-0.63439328416364593), R(-0.59569930449243313), R(-0.55557023301960218), R(-0.51410274419322177), R(-0.47139673682599786), R(-0.42755509343028247), R(-0.38268343236509034), R(-0.33688985339221994), R(-0.29028467725446244), R(-0.24298017990326412), R(-0.19509032201612866), R(-0.1467304744553623), R(-0.098017140329560451), R(-0.049067674327418029), R(-1.8369701987210297e-16), R(0.049067674327417661), R(0.09801714032956009), R(0.14673047445536194), R(0.1950903220161283), R(0.24298017990326376), R(0.29028467725446205), R(0.33688985339221961), R(0.38268343236509), R(0.42755509343028214), R(0.47139673682599759), R(0.51410274419322155), R(0.55557023301960184), R(0.59569930449243291), R(0.6343932841636456), R(0.67155895484701833), R(0.70710678118654735), R(0.74095112535495888), R(0.77301045336273666), R(0.80320753148064505), R(0.83146961230254524), R(0.85772861000027201), R(0.88192126434835483), R(0.90398929312344312), R(0.92387953251128652), R(0.94154406518302081), R(0.95694033573220882), R(0.97003125319454397), R(0.98078528040323032), R(0.9891765099647809), R(0.99518472667219693), R(0.99879545620517241) }
/* end constants */

typedef struct {
    real_t stride_time, lowest, highest, low, high;
    real_t series[STATES - SHAPE];
} template_t;
/* begin templates: stride time, phases of the lowest and highest angle, the angles, the series */
#define TEMPLATES 39
static const template_t templates[TEMPLATES] = {
    {R(0.59999999999999998), R(0.9765625), R(0.65625), R(-0.33507649530348899), R(0.91252204085135702),
      {R(0.28337476088326075), R(-0.42280706660050049), R(-0.25032247091522558), R(-0.15082165384297197), R(0.15016631221323617), R(-0.0088693094136401592), R(0.035639232396131142), R(-0.012097385039804218), R(0.01301616027261765), R(-0.0033047645780727906), R(0.0066576726112849757), R(-0.00071684893476272867), R(0.0014386880097168966)}},
    {R(0.65000000000000002), R(0.9765625), R(0.65625), R(-0.33507649530348899), R(0.91252204085135702),
      {R(0.28337476088326075), R(-0.42280706660050049), R(-0.25032247091522558), R(-0.15082165384297197), R(0.15016631221323617), R(-0.0088693094136401592), R(0.035639232396131142), R(-0.012097385039804218), R(0.01301616027261765), R(-0.0033047645780727906), R(0.0066576726112849757), R(-0.00071684893476272867), R(0.0014386880097168966)}},
    {R(0.70000000000000007), R(0.9765625), R(0.65625), R(-0.33507649530348899), R(0.91252204085135702),
      {R(0.28337476088326075), R(-0.42280706660050049), R(-0.25032247091522558), R(-0.15082165384297197), R(0.15016631221323617), R(-0.0088693094136401592), R(0.035639232396131142), R(-0.012097385039804218), R(0.01301616027261765), R(-0.0033047645780727906), R(0.0066576726112849757), R(-0.00071684893476272867), R(0.0014386880097168966)}},
    {R(0.75000000000000011), R(0.9765625), R(0.65625), R(-0.33507649530348899), R(0.91252204085135702),
      {R(0.28337476088326075), R(-0.42280706660050049), R(-0.25032247091522558), R(-0.15082165384297197), R(0.15016631221323617), R(-0.0088693094136401592), R(0.035639232396131142), R(-0.012097385039804218), R(0.01301616027261765), R(-0.0033047645780727906), R(0.0066576726112849757), R(-0.00071684893476272867), R(0.0014386880097168966)}},
    {R(0.80000000000000016), R(0.9765625), R(0.65625), R(-0.33507649530348899), R(0.91252204085135702),
      {R(0.28337476088326075), R(-0.42280706660050049), R(-0.25032247091522558), R(-0.15082165384297197), R(0.15016631221323617), R(-0.0088693094136401592), R(0.035639232396131142), R(-0.012097385039804218), R(0.01301616027261765), R(-0.0033047645780727906), R(0.0066576726112849757), R(-0.00071684893476272867), R(0.0014386880097168966)}},
    {R(0.8500000000000002), R(0.9765625), R(0.65625), R(-0.33493041438693799), R(0.91232125577350431),
      {R(0.28262557980648939), R(-0.41752574466185666), R(-0.25469684099407874), R(-0.15598667451486228), R(0.14758948074389461), R(-0.0088111742081058465), R(0.037731499793810852), R(-0.011893103890618047), R(0.012622445578274973), R(-0.0034976663826483479), R(0.0069570790373496161), R(-0.00051203805912335512), R(0.0015792599819569567)}},
    {R(0.90000000000000024), R(0.9765625), R(0.6640625), R(-0.33478499088294916), R(0.91255700121270866),
      {R(0.2818764371193675), R(-0.41219790421683278), R(-0.25896277960354563), R(-0.16107631697287095), R(0.14480419505348757), R(-0.0089253631751696656), R(0.039886416428834573), R(-0.011603475168286533), R(0.012265808201601176), R(-0.0037280466089274571), R(0.0072148988357457538), R(-0.00030944680521441869), R(0.0017586333273182807)}},
    {R(0.95000000000000029), R(0.9765625), R(0.6640625), R(-0.3346406407966237), R(0.91245447501019372),
      {R(0.28112731723881457), R(-0.40682590112442685), R(-0.26311988084646665), R(-0.16608186930156771), R(0.14181384237332079), R(-0.0092179222133465764), R(0.04209150711299272), R(-0.011232112077789087), R(0.011958220545243477), R(-0.0039880997022510448), R(0.0074251622238406022), R(-0.00011703922029188296), R(0.0019772180086273603)}},
    {R(1.0000000000000004), R(0.9765625), R(0.671875), R(-0.33449694542073843), R(0.91255044973852417),
      {R(0.2803782043007973), R(-0.40141209139438555), R(-0.26716779041093108), R(-0.17099479745532942), R(0.13862218213708521), R(-0.0096939886971380319), R(0.044333839916733939), R(-0.010784022652255549), R(0.011711304483311553), R(-0.0042690684011299296), R(0.0075831516012960978), R(5.716385169538982e-05), R(0.0022338379272777127)}},
    {R(1.0500000000000003), R(0.9765625), R(0.671875), R(-0.33435259099828135), R(0.91255159361898885),
      {R(0.27962908213231985), R(-0.39595883007016425), R(-0.27110620539538494), R(-0.17580676133246115), R(0.13523333646580094), R(-0.010357760258887239), R(0.046600093250043585), R(-0.010265572335732463), R(0.011536181176358231), R(-0.0045614294317914573), R(0.0076855409596466202), R(0.00020538173985199158), R(0.0025257301042355936)}},
    {R(1.1000000000000005), R(0.9765625), R(0.6796875), R(-0.3342053302581498), R(0.91244278249986277),
      {R(0.2788799505341667), R(-0.39046849559211078), R(-0.27493489449192465), R(-0.18050962319741734), R(0.13165181178915419), R(-0.01121245424107779), R(0.048876595627893787), R(-0.0096844605342720005), R(0.011443339138793144), R(-0.0048550664033509576), R(0.0077305164099402638), R(0.00032034890053848919), R(0.0028485707767152207)}},
    {R(1.1500000000000004), R(0.9765625), R(0.6796875), R(-0.33405196627132666), R(0.91255288172344495),
      {R(0.27813083993971693), R(-0.38494350864017524), R(-0.27865371976691611), R(-0.18509546554676237), R(0.12788251847549928), R(-0.012260261175567846), R(0.051149376665474991), R(-0.0090496864484439464), R(0.011442489333198691), R(-0.0051394679910271249), R(0.0077178897051286546), R(0.00039560453705352771), R(0.0031965402024788959)}},
    {R(1.2000000000000006), R(0.9765625), R(0.6875), R(-0.333888449212765), R(0.91217232105104717),
      {R(0.27738173302300262), R(-0.37938620852326588), R(-0.28226253822632646), R(-0.18955663995265581), R(0.12393060523039877), R(-0.013502399111781162), R(0.053404382018863633), R(-0.0083713206180182284), R(0.011542364275610086), R(-0.0054041182846083745), R(0.0076491124804531439), R(0.00042585824923729203), R(0.0035626088882399305)}},
    {R(1.2500000000000004), R(0.9765625), R(0.6875), R(-0.33370993802873111), R(0.91239676512953505),
      {R(0.27663261335222461), R(-0.37379893082892379), R(-0.28576125881293313), R(-0.19388575089107615), R(0.11980153953078347), R(-0.014939073102659912), R(0.055627453602752702), R(-0.0076604874010265268), R(0.011750652142151548), R(-0.0056386373821214805), R(0.0075272956146544183), R(0.00040714508032971991), R(0.0039386817607028456)}},
    {R(1.3000000000000007), R(0.9765625), R(0.6875), R(-0.33351091317353104), R(0.91188652893002309),
      {R(0.27588346410251352), R(-0.36818400435870169), R(-0.28914984057179532), R(-0.1980756695723152), R(0.11550109243173051), R(-0.016569471187349211), R(0.057804405096136401), R(-0.0069292539551538143), R(0.012073882826403827), R(-0.0058330241524361427), R(0.0073571950572864017), R(0.00033702481317670946), R(0.0043158419179999226)}},
    {R(1.3500000000000005), R(0.984375), R(0.6953125), R(-0.33346633124033631), R(0.91202653148534929),
      {R(0.27513426802122365), R(-0.362543750073613), R(-0.29242829230841694), R(-0.20211954645765598), R(0.11103532524704607), R(-0.018391764738116489), R(0.059921095181441932), R(-0.006190510007118807), R(0.012517326725424875), R(-0.0059778944743792929), R(0.0071451648209400701), R(0.00021473682765889751), R(0.0046846267301950389)}},
    {R(1.4000000000000008), R(0.984375), R(0.6953125), R(-0.3335406284986609), R(0.91161553316367372),
      {R(0.27438518869893064), R(-0.3568807235716534), R(-0.29559694090106892), R(-0.20601085865148641), R(0.1064109365878641), R(-0.020402822825943981), R(0.061963284454416852), R(-0.0054581931125614437), R(0.013084835324729899), R(-0.0060645266048336395), R(0.0068993882719982401), R(4.1412055866428951e-05), R(0.0050349836991338513)}},
    {R(1.4500000000000006), R(0.984375), R(0.703125), R(-0.33359358726887178), R(0.91139852221344841),
      {R(0.27363613063563269), R(-0.35119710607285604), R(-0.29865579419879607), R(-0.2097433802921167), R(0.10163436689357097), R(-0.022598890852541846), R(0.06391728838787944), R(-0.0047462642819879764), R(0.013778848838324705), R(-0.0060856360753189561), R(0.0066290647218124506), R(-0.00018000007474934559), R(0.0053574832286294814)}},
    {R(1.5000000000000009), R(0.984375), R(0.703125), R(-0.33361879670011463), R(0.91109279148876754),
      {R(0.27288703975828388), R(-0.34549513189080194), R(-0.30160496275724175), R(-0.21331118394475787), R(0.096712386305301601), R(-0.024975188860517649), R(0.065769611166291514), R(-0.0040691687328359098), R(0.014600354441509006), R(-0.0060351320397855433), R(0.0063446825593293042), R(-0.00044476347351029281), R(0.0056430334446113031)}},
    {R(1.5500000000000007), R(0.984375), R(0.7109375), R(-0.33360972594457239), R(0.91048616654683567),
      {R(0.27213789840900954), R(-0.33977707391805489), R(-0.30444465868282511), R(-0.2167086683222148), R(0.091652069080567833), R(-0.027525921446720777), R(0.067507041994197908), R(-0.003441671772781864), R(0.01554880550381561), R(-0.0059083430725598227), R(0.0060578713482302739), R(-0.00074636295990616278), R(0.0058832237282646308)}},
    {R(1.600000000000001), R(0.984375), R(0.7109375), R(-0.33355998238390638), R(0.91029279821367926),
      {R(0.27138868839747893), R(-0.33404519174845498), R(-0.30717514170036364), R(-0.21993056353232615), R(0.086460704309206299), R(-0.030244359911069107), R(0.069116770851096368), R(-0.0028786286806055782), R(0.016622099798484904), R(-0.0057022246040700532), R(0.005781147557122745), R(-0.0010766332843948198), R(0.0060707175794236842)}},
    {R(1.6500000000000008), R(0.984375), R(0.71875), R(-0.33346349456436225), R(0.90928633274184301),
      {R(0.2706394402493274), R(-0.32830178648762209), R(-0.30979679994668208), R(-0.22297197467168375), R(0.081145872003411987), R(-0.033122777325477484), R(0.070586431084867785), R(-0.0023948984047063708), R(0.017816500204388262), R(-0.0054155081021642522), R(0.0055277940099395543), R(-0.001425844021375165), R(0.0061995090726515347)}},
    {R(1.7000000000000011), R(0.984375), R(0.71875), R(-0.33331458113731732), R(0.90921587026096229),
      {R(0.26989046951413015), R(-0.32254944753221404), R(-0.31231055240617733), R(-0.22582860308569225), R(0.075715849814866065), R(-0.036152010281676278), R(0.071904122780361207), R(-0.0020054663863250627), R(0.01912625329237112), R(-0.0050489877814676922), R(0.0053120682761913186), R(-0.0017824474755054054), R(0.0062651142841931252)}},
    {R(1.7500000000000009), R(0.984375), R(0.71875), R(-0.33310900076684274), R(0.90830001401966698),
      {R(0.26914144547888313), R(-0.31679001506102278), R(-0.31471629974738935), R(-0.2284960413283012), R(0.070177870879479992), R(-0.039323333908954233), R(0.073058842160077186), R(-0.0017239521400297655), R(0.020544933707844361), R(-0.0046052334646477927), R(0.0051470973677039608), R(-0.0021351033123557369), R(0.006265540246995091)}},
    {R(1.8000000000000012), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
    {R(1.850000000000001), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
    {R(1.9000000000000012), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
    {R(1.9500000000000011), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
    {R(2.0000000000000013), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
    {R(2.0500000000000012), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
    {R(2.1000000000000014), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
    {R(2.1500000000000012), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
    {R(2.2000000000000015), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
    {R(2.2500000000000013), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
    {R(2.3000000000000016), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
    {R(2.3500000000000014), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
    {R(2.4000000000000017), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
    {R(2.4500000000000015), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
    {R(2.5000000000000018), R(0.984375), R(0.7265625), R(-0.3328432264308448), R(0.90788750611041302),
      {R(0.26839234944478607), R(-0.31102567804857895), R(-0.31701449479424382), R(-0.23097043684874025), R(0.0645399098369), R(-0.04262664889001154), R(0.07404004306426315), R(-0.0015639259664750539), R(0.022064239881601791), R(-0.0040888021854656991), R(0.0050465399342498555), R(-0.0024713115852357456), R(0.0062005063488746771)}},
};
/* end templates */

typedef struct {
    real_t lead, window, since_look, looks[LOOKS][2]; /* the latest last: angle, phase */
    real_t state[STATES], covariance[STATES][STATES], wave[STATES];
    real_t age, agreed, misfit, worst, stated, rate, cadence, origin, unstruck, since_strike, since_swing;
    real_t noise, filtered, innovation, last; /* `last` is NEVER where there was no sample */
    real_t gap; /* since the last sample that was not lost */
    real_t before, high, low, since_high, since_low; /* of a swing that is looked for */
    real_t home[2], now[2], before_it[2]; /* extremes of usual swings, of late, of the last: high, low */
    real_t shift, heel, mean[BINS], count[BINS]; /* of the heel strike */
    uint8_t looked, follows, stopped, falls, has_kept, against, calibrated, knows_swings, strange, off_pace, uneven, same, heel_seen, begun;
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

static const real_t cosines[EXTREMES] = COSINES; /* of a turn */

static void phase_template(template_t *t, real_t stride_time, const real_t *series)
{
    int lowest = 0, highest = 0;
    memcpy(t->series, series, sizeof t->series);
    t->stride_time = stride_time;
    for (int k = 0; k < EXTREMES; k++) {
        real_t angle = series[0];
        for (int j = 1; j <= HARMONICS; j++)
            angle += series[2 * j - 1] * cosines[j * k % EXTREMES] + series[2 * j] * cosines[(j * k + EXTREMES * 3 / 4) % EXTREMES];
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
    const real_t sine = p->state[SHAPE + 2], cosine = p->state[SHAPE + 1];
    return (sizeof(real_t) == sizeof(float) ? R(atan2f((float)sine, (float)cosine)) : R(atan2((double)sine, (double)cosine))) / TURN;
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
static inline real_t phase_stride_time(const phase_t *p) { return 1 / most(p->rate, SLOWEST); }
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
    p->looks[LOOKS - 1][0] = p->filtered;
    p->looks[LOOKS - 1][1] = p->state[0];
    if (p->looked < LOOKS)
        p->looked++;
    for (int k = LOOKS - enough; k < LOOKS; k++)
        mean += p->looks[k][0] / (real_t)enough;
    for (int k = LOOKS - enough; k < LOOKS; k++)
        square += (p->looks[k][0] - mean) * (p->looks[k][0] - mean) / (real_t)enough;
    return p->looked >= enough && square - p->noise * phase_left_over(dt / ANGLE_FILTER) < STILL * STILL;
}

static void phase_agree(phase_t *p, real_t innovation, real_t part)
{
    const real_t change = innovation - p->last, gain = least(part / MISFIT_FILTER, 1);
    if (p->agreed > 0 && p->last < NEVER)
        p->noise += least(part / NOISY, 1) * (R(0.5) * change * change - p->noise);
    p->last = innovation;
    p->innovation += gain * (innovation - p->innovation);
    p->misfit += least(part / RECENT, 1) * (p->innovation * p->innovation - phase_left_over(gain) * p->noise - p->misfit);
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
    off = fabs_r(p->filtered - phase_series(p->state + SHAPE, p->state[0], p->wave)) - CERTAIN * fabs_r(p->wave[0]);
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
    real_t score[BINS], level[BINS], doubt[BINS], best = R(0.5) * NOTHING, usual = 0, whole = 0, seen = 0, mean = 0;
    for (int at = spare; at < BINS - spare; at++) {
        level[at] = doubt[at] = 0;
        for (int k = 0; k <= 2 * spare; k++) {
            const real_t weight = weights[k], count = p->count[at + k - spare];
            level[at] += weight * p->mean[at + k - spare];
            doubt[at] += weight * weight / (count > ENOUGH ? count : R(1e-9));
        }
    }
    for (int pass = 0; pass < 3; pass++)
        for (int middle = half + spare; middle < BINS - half - spare; middle++) {
            const real_t place = FROM + BIN * (real_t)middle - DIP * p->rate;
            const real_t bend = level[middle - half] + level[middle + half] - 2 * level[middle], dip = most(bend, 0);
            const real_t variance = doubt[middle - half] + doubt[middle + half] + 4 * doubt[middle];
            if (pass == 0) {
                usual += bend * bend / (real_t)(BINS - 2 * (half + spare));
            } else if (pass == 1) {
                score[middle] = R(0.5) * (dip * dip / (p->noise * variance + RESIDUAL * RESIDUAL + USUAL * usual) - place * place / (SPREAD * SPREAD));
                best = most(best, score[middle]);
            } else {
                const real_t weight = exp_r(score[middle] - best);
                seen += weight;
                mean += weight * place;
            }
        }
    whole = seen + exp_r(R(0.5) * NOTHING - best);
    p->heel = mean / whole;
    p->heel_seen = seen > SURE * whole;
}

static void phase_swung(phase_t *p, real_t late)
{
    const int away = p->same >= SETTLED;
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
    p->uneven = (uint8_t)(p->off_pace ? p->uneven + 1 : 0);
    if (!p->strange)
        p->off_pace = 0;
    if (away && !p->same && p->has_kept && p->follows) {
        phase = p->state[0];
        memcpy(p->state + SHAPE, p->kept.series, sizeof p->kept.series);
        if (p->calibrated)
            phase_turn(p, apart(p->origin, phase_origin(p)));
        p->state[0] = phase;
    }
    p->window = least(most(SHARE * like->stride_time, SHORTEST_WINDOW), LONGEST_WINDOW);
    p->since_swing = ago;
    if (stride > SHORTEST_STRIDE && stride < LONGEST_STRIDE)
        p->cadence = 1 / stride;
    else if (!(p->cadence > 0))
        p->cadence = rate;
    phase = t->lowest + rate * ago;
    phase_template(&shape, like->stride_time, p->state + SHAPE);
    if (!p->follows || p->uneven >= UNEVEN || fabs_r(apart(p->state[0], phase)) > (p->unstruck < SEEN ? AGREES_STRUCK : AGREES)
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
        p->uneven = 0;
        p->against = (uint8_t)(p->against < AGAINST ? p->against + 1 : AGAINST);
        p->follows = 1;
        p->stated = -NEVER;
        p->agreed = p->misfit = p->innovation = 0;
        p->last = NEVER;
        p->rate = p->state[1] = p->cadence;
        p->state[0] = phase;
        if (p->calibrated)
            phase_turn(p, apart(p->origin, phase_origin(p)));
        phase_loosen(p, PHASE * PHASE, RATE * rate * RATE * rate);
    } else {
        p->against = 0;
        if (p->agreed > 1 && !p->strange && !p->same) {
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
    real_t *state = p->state, error, innovation, phase;
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
        innovation = value - phase_series(state + SHAPE, state[0], p->wave);
        phase_agree(p, innovation, most(gone, R(0.5) * dt));
        error = LEARNT + (BEGUN - LEARNT) * exp_r(-p->age / FORGOTTEN);
        phase_correct(p, p->wave, innovation, error * error * SAMPLE / dt + p->noise);
        if (p->agreed > R(0.5) && !p->strange)
            heel_take(p, innovation, gone);
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
        p->filtered = p->begun && lost <= SHORTEST_WINDOW ? p->filtered + least((dt + lost) / ANGLE_FILTER, 1) * (value - p->filtered) : value;
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
    if (phase_swing(p, p->filtered, dt)) {
        if (p->high - p->low > RANGE)
            phase_swung(p, most(ANGLE_FILTER - dt, 0));
        p->falls = 0;
        p->before = p->low;
        p->high = p->filtered;
        p->since_high = 0;
    }
    if (p->follows)
        phase_follow(p, value, dt, struck);
    if (p->state[0] > 8 && p->stated > 4) { /* in hours a float's phase would grow coarse */
        p->state[0] -= 4;
        p->stated -= 4;
        for (int k = 0; k < LOOKS; k++)
            p->looks[k][1] -= 4;
    }
}
