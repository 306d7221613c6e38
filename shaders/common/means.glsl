// What lies between three points of a ray, where all goes evenly from one to the next.

struct Means {
    vec4 near;          // from the first to the second: mean colour and extinction per mm
    vec4 far;           // from the second to the third
    vec4 whole;         // from the first to the third
    float missed;       // the extinction that the three may pass by
};
