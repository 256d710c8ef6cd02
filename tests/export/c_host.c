/*
 * A host of the tests' own: loads a unit, runs it in steps of any length, saves its state, serialises it,
 * and goes on in a second instance.  Prints the output angle after each step as hexadecimal floats.
 *
 *     host UNIT.so GUID STEPS STEP COMMAND SAVE_AT
 */
#ifdef _WIN32
#include <windows.h>
#define OPEN(name) (void *)LoadLibraryA(name)
#define SYMBOL(library, name) (void *)GetProcAddress((HMODULE)(library), name)
#else
#include <dlfcn.h>
#define OPEN(name) dlopen(name, RTLD_NOW)
#define SYMBOL(library, name) dlsym(library, name)
#endif
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} callbacks;

static void say(void *e, const char *name, int status, const char *category, const char *text, ...)
{
    va_list more;
    (void)e;
    va_start(more, text);
    fprintf(stderr, "%s %d %s ", name, status, category);
    vfprintf(stderr, text, more);
    va_end(more);
    fputc('\n', stderr);
}

static const callbacks CALLBACKS = {say, calloc, free, NULL, NULL};

#define FIND(name) *(void **)&name = SYMBOL(library, "fmi2" #name); if (name == NULL) { return 3; }

int main(int argc, char **argv)
{
    void *(*Instantiate)(const char *, int, const char *, const char *, const callbacks *, int, int);
    void (*FreeInstance)(void *);
    int (*SetupExperiment)(void *, int, double, double, int, double);
    int (*EnterInitializationMode)(void *);
    int (*ExitInitializationMode)(void *);
    int (*SetReal)(void *, const unsigned int *, size_t, const double *);
    int (*GetReal)(void *, const unsigned int *, size_t, double *);
    int (*DoStep)(void *, double, double, int);
    int (*GetFMUstate)(void *, void **);
    int (*SetFMUstate)(void *, void *);
    int (*FreeFMUstate)(void *, void **);
    int (*SerializedFMUstateSize)(void *, void *, size_t *);
    int (*SerializeFMUstate)(void *, void *, char *, size_t);
    int (*DeSerializeFMUstate)(void *, const char *, size_t, void **);
    const unsigned int command = 1U, angle = 10U;
    void *library = (argc > 6) ? OPEN(argv[1]) : NULL;
    void *unit, *state = NULL, *copy = NULL;
    double value, step, now = 0.0;
    long steps, save_at;

    if (library == NULL) {
        return 2;
    }
    FIND(Instantiate) FIND(FreeInstance) FIND(SetupExperiment) FIND(EnterInitializationMode)
    FIND(ExitInitializationMode) FIND(SetReal) FIND(GetReal) FIND(DoStep) FIND(GetFMUstate) FIND(SetFMUstate)
    FIND(FreeFMUstate) FIND(SerializedFMUstateSize) FIND(SerializeFMUstate) FIND(DeSerializeFMUstate)
    steps = strtol(argv[3], NULL, 10);
    step = strtod(argv[4], NULL);
    value = strtod(argv[5], NULL);
    save_at = strtol(argv[6], NULL, 10);
    if (Instantiate("a", 1, "wrong", "", &CALLBACKS, 0, 0) != NULL) {
        return 4;
    }
    unit = Instantiate("a", 1, argv[2], "", &CALLBACKS, 0, 0);
    if (unit == NULL || SetupExperiment(unit, 0, 0.0, 0.0, 0, 0.0) != 0 || EnterInitializationMode(unit) != 0 ||
        SetReal(unit, &command, 1, &value) != 0 || ExitInitializationMode(unit) != 0) {
        return 5;
    }
    for (long k = 0; k < steps; k += 1) {
        if (k == save_at) {
            size_t size = 0;
            char *bytes;
            if (GetFMUstate(unit, &state) != 0 || SerializedFMUstateSize(unit, state, &size) != 0) {
                return 6;
            }
            bytes = malloc(size);
            if (bytes == NULL || SerializeFMUstate(unit, state, bytes, size) != 0) {
                return 7;
            }
            FreeFMUstate(unit, &state);
            FreeInstance(unit);
            unit = Instantiate("b", 1, argv[2], "", &CALLBACKS, 0, 0);
            if (unit == NULL || DeSerializeFMUstate(unit, bytes, size, &copy) != 0 || SetFMUstate(unit, copy) != 0) {
                return 8;
            }
            FreeFMUstate(unit, &copy);
            free(bytes);
        }
        if (DoStep(unit, now, step, 1) != 0) {
            return 9;
        }
        now = (double)(k + 1) * step;
        if (GetReal(unit, &angle, 1, &value) != 0) {
            return 10;
        }
        printf("%a\n", value);
    }
    FreeInstance(unit);
    return 0;
}
