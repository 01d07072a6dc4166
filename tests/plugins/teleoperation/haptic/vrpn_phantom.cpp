// A force device as the VRPN project's own library (github vrpn/vrpn) makes one, after server_src/vrpn_Phantom.C, but
// without hardware: a line "x y z grip" [m] on its input is where the stylus is, and each force field that a client sets
// is a line "force fx fy fz radius" of its output. Argument: the TCP port. A number alone on a line is told as its error.
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <string>
#include <unistd.h>
#include <vrpn_Button.h>
#include <vrpn_Connection.h>
#include <vrpn_ForceDevice.h>
#include <vrpn_Tracker.h>

class Phantom : public vrpn_ForceDevice, public vrpn_Tracker, public vrpn_Button_Filter {
public:
    explicit Phantom(vrpn_Connection *connection)
        : vrpn_ForceDevice("Phantom", connection), vrpn_Tracker("Phantom", connection),
          vrpn_Button_Filter("Phantom", connection)
    {
        num_buttons = 2;
        auto *c = vrpn_ForceDevice::d_connection;
        c->register_handler(forcefield_message_id, field, this, vrpn_ForceDevice::d_sender_id);
        c->register_handler(c->register_message_type(vrpn_got_first_connection), tell, (void *)"connected");
        c->register_handler(c->register_message_type(vrpn_dropped_last_connection), tell, (void *)"dropped");
    }
    void say(double x, double y, double z, int grip)
    {
        pos[0] = x, pos[1] = y, pos[2] = z;
        char text[1000];
        vrpn_gettimeofday(&(vrpn_Tracker::timestamp), nullptr);
        const int size = vrpn_Tracker::encode_to(text);
        vrpn_Tracker::d_connection->pack_message(size, vrpn_Tracker::timestamp, position_m_id,
                                                 vrpn_Tracker::d_sender_id, text, vrpn_CONNECTION_LOW_LATENCY);
        buttons[0] = grip;
        vrpn_gettimeofday(&(vrpn_Button_Filter::timestamp), nullptr);
        report_changes();
    }
    void fail(int code) { sendError(code); }
    void mainloop() override
    {
        vrpn_ForceDevice::server_mainloop();
        vrpn_Tracker::server_mainloop();
        vrpn_Button_Filter::server_mainloop();
    }

private:
    static int VRPN_CALLBACK field(void *, vrpn_HANDLERPARAM said)
    {
        vrpn_float32 origin[3], force[3], jacobian[3][3], radius;
        if (decode_forcefield(said.buffer, said.payload_len, origin, force, jacobian, &radius)) return -1;
        std::printf("force %.9g %.9g %.9g %.9g\n", force[0], force[1], force[2], radius);
        std::fflush(stdout);
        return 0;
    }
    static int VRPN_CALLBACK tell(void *word, vrpn_HANDLERPARAM)
    {
        std::printf("%s\n", (const char *)word);
        std::fflush(stdout);
        return 0;
    }
};

int main(int, char **words)
{
    vrpn_Connection *connection = vrpn_create_server_connection(std::atoi(words[1]));
    Phantom phantom(connection);
    fcntl(0, F_SETFL, O_NONBLOCK);
    std::printf("ready\n");
    std::fflush(stdout);
    std::string pending;
    for (;;) {
        char part[4096];
        const auto size = read(0, part, sizeof part);
        if (size == 0) return 0;
        if (size > 0) pending.append(part, size);
        for (size_t end; (end = pending.find('\n')) != std::string::npos; pending.erase(0, end + 1)) {
            double x, y, z;
            int grip;
            if (std::sscanf(pending.c_str(), "%lf %lf %lf %d", &x, &y, &z, &grip) == 4)
                phantom.say(x, y, z, grip);
            else
                phantom.fail(std::atoi(pending.c_str()));
        }
        phantom.mainloop();
        connection->mainloop();
        usleep(100);
    }
}
